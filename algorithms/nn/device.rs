//! Selects the device on which networks are trained.

use asid_core::{Error, Result};
use asid_learned::PpoConfig;
use tch::Device;

/// The device that the settings name.
///
/// # Errors
/// [`Error::Missing`] where libtorch does not see this device.
pub fn device(config: &PpoConfig) -> Result<Device> {
    let index = match config.device.as_str() {
        "cpu" => return Ok(Device::Cpu),
        "cuda" => Some(0),
        other => other.strip_prefix("cuda:").and_then(|i| i.parse().ok()),
    };
    match index {
        Some(index) if i64::try_from(index).is_ok_and(|i| i < tch::Cuda::device_count()) => {
            Ok(Device::Cuda(index))
        }
        _ => Err(Error::Missing {
            what: format!("device {}", config.device),
            message:
                "this libtorch sees no such GPU; set device = \"cpu\", or LIBTORCH to a CUDA build"
                    .to_owned(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_that_is_not_there_is_named() {
        let of = |name: &str| {
            device(&PpoConfig {
                device: name.into(),
                ..PpoConfig::default()
            })
        };
        assert_eq!(of("cpu").unwrap(), Device::Cpu);
        let message = of("cuda:99").unwrap_err().to_string();
        assert!(message.contains("cuda:99 is not available"), "{message}");
    }
}
