//! A device without a window.

use std::{
    fmt,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use halflight_frame_graph::Gpu;

use crate::memory::memory_for_plans;

/// Which adapter to open.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum AdapterChoice {
    /// A discrete or integrated GPU where there is one, otherwise a software adapter.
    #[default]
    Any,
    /// Only real GPUs.
    Gpu,
    /// Only software adapters (lavapipe, SwiftShader, WARP).
    Software,
    /// The first adapter whose name holds this text, letter case ignored. If the text is a number, the adapter of that
    /// number in the list of [`adapters`], from 1: it tells apart adapters of one name.
    Named(String),
}

impl From<&str> for AdapterChoice {
    fn from(text: &str) -> Self {
        match text {
            "" | "any" => Self::Any,
            "gpu" => Self::Gpu,
            "software" => Self::Software,
            name => Self::Named(name.to_owned()),
        }
    }
}

/// Why no device could be opened: one sentence with the fix.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct DeviceError(String);

impl DeviceError {
    pub(crate) fn new(sentence: impl Into<String>) -> Self {
        Self(sentence.into())
    }
}

/// Why a device did not make something.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// The device was lost.
    #[error("the device was lost: run again, with --resume for a grid")]
    Lost,
    /// It cannot hold what was asked for; what it said.
    #[error("the device refused ({0})")]
    Refused(String),
}

/// A device and what is known of the adapter behind it.
pub struct NativeGpu {
    /// The device, as the renderer wants it.
    pub gpu: Gpu,
    /// Name, driver, backend and type of the adapter.
    pub info: wgpu::AdapterInfo,
    handler: Handler,
}

impl NativeGpu {
    /// Opens a device with the features and limits that [`Gpu`] wants.
    ///
    /// # Errors
    /// Where no adapter fits the choice, or its driver refuses the device.
    pub fn open(choice: &AdapterChoice) -> Result<Self, DeviceError> {
        let mut found = instance_adapters();
        found.sort_by_key(|adapter| preference(adapter.get_info().device_type));
        let software = |adapter: &wgpu::Adapter| adapter.get_info().device_type == wgpu::DeviceType::Cpu;
        let names: Vec<String> = found.iter().map(|adapter| adapter.get_info().name).collect();
        let number = match choice {
            AdapterChoice::Named(text) => {
                text.parse::<usize>().ok().filter(|number| (1..=found.len()).contains(number))
            }
            _ => None,
        };
        let adapter = found
            .into_iter()
            .enumerate()
            .find(|(index, adapter)| match choice {
                _ if number.is_some() => number == Some(index + 1),
                AdapterChoice::Any => true,
                AdapterChoice::Gpu => !software(adapter),
                AdapterChoice::Software => software(adapter),
                AdapterChoice::Named(name) => adapter.get_info().name.to_lowercase().contains(&name.to_lowercase()),
            })
            .map(|(_, adapter)| adapter)
            .ok_or_else(|| DeviceError(missing(choice, &names)))?;
        let info = adapter.get_info();
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("halflight"),
            required_features: adapter.features() & Gpu::WANTED_FEATURES,
            required_limits: Gpu::wanted_limits(&adapter.limits()),
            ..Default::default()
        }))
        .map_err(|e| {
            DeviceError(format!("adapter \"{}\" refused a device: {e}; choose another with --adapter", info.name))
        })?;
        let handler = Handler::of(&device);
        let mut gpu = Gpu::new(device, queue);
        gpu.memory = memory_for_plans(&adapter);
        Ok(Self { gpu, info, handler })
    }

    /// What `make` makes on the device. What a device can hold is not known before it is asked.
    ///
    /// # Errors
    /// If the device refuses something, for example because it is too large, or was lost.
    pub fn refusals<T>(&self, make: impl FnOnce() -> T) -> Result<T, Refusal> {
        let memory = self.gpu.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let limits = self.gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let made = make();
        // The scope that was opened last ends first. What is missing for want of memory is not valid either.
        let (invalid, out_of_memory) = (pollster::block_on(limits.pop()), pollster::block_on(memory.pop()));
        match out_of_memory.or(invalid) {
            None => Ok(made),
            Some(error) => {
                let said = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
                Err(if self.handler.was_lost() { Refusal::Lost } else { Refusal::Refused(said) })
            }
        }
    }

    /// Whether the adapter runs on the processor; its times compare only as ratios.
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }
}

/// Longest time between the first error of a lost device and the callback that reports the loss: a thread has to be
/// scheduled for it.
const LOSS_IS_TOLD: Duration = Duration::from_secs(2);

/// Errors of a device that was lost are not this program's mistakes: they end with a sentence when its results are read,
/// and not here. All others panic, as they do where nobody handles them.
struct Handler {
    device: wgpu::Device,
    lost: Arc<AtomicBool>,
}

impl Handler {
    fn of(device: &wgpu::Device) -> Self {
        let lost = Arc::new(AtomicBool::new(false));
        let told = lost.clone();
        device.set_device_lost_callback(move |_, _| told.store(true, Ordering::Release));
        let (own, flag) = (device.clone(), lost.clone());
        device.on_uncaptured_error(Arc::new(move |error| {
            if !loss_is_reported(&own, &flag) {
                panic!("the device refused: {error}");
            }
        }));
        Self { device: device.clone(), lost }
    }

    /// Whether an error came of a loss of the device.
    fn was_lost(&self) -> bool {
        loss_is_reported(&self.device, &self.lost)
    }
}

/// Waits for the report of a loss. It comes once the device is idle, and perhaps by another thread that polls it: later than
/// the first error that comes of it. Who made a mistake can wait for the answer.
fn loss_is_reported(device: &wgpu::Device, lost: &AtomicBool) -> bool {
    let begin = Instant::now();
    while !lost.load(Ordering::Acquire) {
        if begin.elapsed() > LOSS_IS_TOLD {
            return false;
        }
        drop(device.poll(wgpu::PollType::wait_indefinitely()));
        thread::sleep(Duration::from_millis(5));
    }
    true
}

impl Drop for Handler {
    /// The handler holds the device that holds the handler.
    fn drop(&mut self) {
        self.device.on_uncaptured_error(Arc::new(|error| panic!("the device refused: {error}")));
    }
}

impl fmt::Debug for NativeGpu {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("NativeGpu").field("info", &self.info).finish_non_exhaustive()
    }
}

/// Every adapter of this computer that can run the passes, best first.
pub fn adapters() -> Vec<wgpu::AdapterInfo> {
    let mut infos: Vec<_> = instance_adapters().iter().map(wgpu::Adapter::get_info).collect();
    infos.sort_by_key(|info| preference(info.device_type));
    infos
}

fn instance_adapters() -> Vec<wgpu::Adapter> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY))
}

fn preference(kind: wgpu::DeviceType) -> u8 {
    match kind {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Cpu => 3,
        wgpu::DeviceType::Other => 4,
    }
}

fn missing(choice: &AdapterChoice, names: &[String]) -> String {
    let install = "install a Vulkan driver (on Debian or Ubuntu: apt-get install mesa-vulkan-drivers libvulkan1)";
    match (choice, names) {
        (_, []) => format!("no Vulkan, Metal or DirectX 12 adapter was found: {install}"),
        (AdapterChoice::Gpu, _) => format!("no GPU was found, only {}: use --adapter software", names.join(", ")),
        (AdapterChoice::Software, _) => format!("no software adapter was found: {install}, or use --adapter gpu"),
        (AdapterChoice::Named(name), _) => {
            let numbered: Vec<_> = (1..).zip(names).map(|(number, name)| format!("{number} ({name})")).collect();
            format!("no adapter is called \"{name}\": choose one of {}", numbered.join(", "))
        }
        (AdapterChoice::Any, _) => format!("no adapter can be used: {install}"),
    }
}
