//! The computer that a row was measured on.

use std::{env, fs};

/// Its name in the network; empty where the system does not say.
pub(super) fn name() -> String {
    let file = fs::read_to_string("/proc/sys/kernel/hostname").ok();
    let variable = || ["HOSTNAME", "COMPUTERNAME"].iter().find_map(|name| env::var(name).ok());
    file.or_else(variable).unwrap_or_default().trim().to_owned()
}

/// The model of its processor; the architecture where the system does not say.
pub(super) fn processor() -> String {
    let file = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = file.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    model.map_or(env::consts::ARCH, |(_, model)| model.trim()).to_owned()
}
