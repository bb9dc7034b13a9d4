//! Memory of an adapter.

use std::fs;

/// Share of an adapter's memory that a plan may use. The rest is left for the driver, the window system and buffers
/// between the computer and the device.
const SHARE: f64 = 0.9;

/// Bytes that plans may use on this adapter: nine tenths of its largest heap, or of the computer's free memory for a
/// software adapter. `None` if neither is known: only Vulkan tells of heaps, and only Linux of free memory.
pub(crate) fn memory_for_plans(adapter: &wgpu::Adapter) -> Option<u64> {
    // A software adapter tells of a heap that is smaller than what it can hold.
    let software = adapter.get_info().device_type == wgpu::DeviceType::Cpu;
    let bytes = if software { free_memory(&fs::read_to_string("/proc/meminfo").ok()?) } else { largest_heap(adapter) };
    Some((bytes? as f64 * SHARE) as u64).filter(|&bytes| bytes > 0)
}

fn largest_heap(adapter: &wgpu::Adapter) -> Option<u64> {
    // SAFETY: the handles are only read here, while the adapter is alive, and nothing is destroyed.
    let heaps = unsafe {
        let vulkan = adapter.as_hal::<wgpu::hal::api::Vulkan>()?;
        vulkan.shared_instance().raw_instance().get_physical_device_memory_properties(vulkan.raw_physical_device())
    };
    heaps.memory_heaps_as_slice().iter().map(|heap| heap.size).max()
}

/// Bytes that programs can still allocate, from the text of `/proc/meminfo`.
fn free_memory(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn free_memory_is_read() {
        let text = "MemTotal:       24689756 kB\nMemFree:          218960 kB\nMemAvailable:   22553680 kB\n";
        assert_eq!(free_memory(text), Some(22_553_680 * 1024));
        assert_eq!(free_memory("MemTotal: 1 kB\n"), None);
        assert_eq!(free_memory("MemAvailable: many kB\n"), None);
    }
}
