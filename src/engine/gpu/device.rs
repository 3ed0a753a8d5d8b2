//! The device: opening it, waiting for it, and reporting its faults.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use crate::util::error::{Error, Result};

/// Options for opening a device.
#[derive(Clone, Debug)]
pub struct DeviceOptions {
    /// Part of the adapter's name, in any case; `None` chooses the fastest adapter.
    pub adapter: Option<String>,
    /// Longest wait for one submission before it counts as hung.
    pub watchdog: Duration,
}

impl Default for DeviceOptions {
    fn default() -> Self {
        DeviceOptions { adapter: None, watchdog: Duration::from_secs(60) }
    }
}

/// An open device.
pub struct Gpu {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// Name, kind and driver of the adapter.
    pub info: wgpu::AdapterInfo,
    /// Whether timestamp queries can time passes on the device.
    pub timestamps: bool,
    watchdog: Duration,
    fault: Arc<Mutex<Option<Fault>>>,
}

#[derive(Clone, Debug)]
enum Fault {
    Lost(String),
    OutOfMemory(String),
    /// The driver refused what the interface allows.
    Refused(String),
    /// A validation error: a bug of this program.
    Bug(String),
}

/// Whether an adapter is a program that runs on the CPU, such as Mesa's llvmpipe.
pub fn is_software(info: &wgpu::AdapterInfo) -> bool {
    info.device_type == wgpu::DeviceType::Cpu
}

fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::PRIMARY;
    wgpu::Instance::new(descriptor)
}

/// Returns all adapters of this machine.
pub fn adapters() -> Vec<wgpu::Adapter> {
    pollster::block_on(instance().enumerate_adapters(wgpu::Backends::PRIMARY))
}

impl Gpu {
    /// Opens the fastest adapter, or the first whose name contains `options.adapter`.
    ///
    /// # Errors
    /// [`Error::NoAdapter`] if there is no such adapter, or if it lacks a feature or limit that the passes
    /// need.
    pub fn open(options: &DeviceOptions) -> Result<Gpu> {
        Gpu::open_on(Gpu::adapter(options)?, options)
    }

    /// Returns the fastest adapter, or the first whose name contains `options.adapter`.
    ///
    /// # Errors
    /// [`Error::NoAdapter`] if there is no such adapter.
    pub fn adapter(options: &DeviceOptions) -> Result<wgpu::Adapter> {
        Ok(match &options.adapter {
            Some(name) => {
                let wanted = name.to_lowercase();
                let all = adapters();
                let names: Vec<String> = all.iter().map(|a| a.get_info().name).collect();
                all.into_iter()
                    .find(|a| a.get_info().name.to_lowercase().contains(&wanted))
                    .ok_or_else(|| unknown_adapter(name, &names))?
            }
            None => pollster::block_on(instance().request_adapter(&wgpu::RequestAdapterOptions {
                power_preference: wgpu::PowerPreference::HighPerformance,
                ..Default::default()
            }))
            .map_err(|_| Error::NoAdapter {
                what: "no GPU adapter was found".into(),
                fix: "install a Vulkan driver (Debian: mesa-vulkan-drivers) or use --engine cpu".into(),
            })?,
        })
    }

    /// Opens an adapter.
    ///
    /// # Errors
    /// [`Error::NoAdapter`] if it lacks a feature or limit that the passes need.
    pub fn open_on(adapter: wgpu::Adapter, options: &DeviceOptions) -> Result<Gpu> {
        let info = adapter.get_info();
        let has = adapter.limits();
        let required_limits = wgpu::Limits {
            max_texture_dimension_2d: has.max_texture_dimension_2d,
            max_texture_dimension_3d: has.max_texture_dimension_3d,
            max_storage_buffer_binding_size: has.max_storage_buffer_binding_size,
            max_buffer_size: has.max_buffer_size,
            // Lights, quads, sums, counts, light places, profiles and workgroups. WebGPU guarantees 8.
            max_storage_buffers_per_shader_stage: has.max_storage_buffers_per_shader_stage.min(8),
            ..wgpu::Limits::downlevel_defaults()
        };
        // Software Vulkan may write the first timestamp of a compute pass late: after a submission that drew
        // nothing, lavapipe reports 0.03 ms of 40 ms. The host's clock is accurate to 0.4 ms there.
        let software = is_software(&info);
        let timestamps = adapter.features().contains(wgpu::Features::TIMESTAMP_QUERY) && !software;
        let required_features =
            if timestamps { wgpu::Features::TIMESTAMP_QUERY } else { wgpu::Features::empty() };
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("taki"),
            required_features,
            required_limits,
            ..Default::default()
        }))
        .map_err(|e| Error::NoAdapter {
            what: format!("{} cannot be used: {}", info.name, one_line(&e.to_string())),
            fix: "name another one with --adapter, or use --engine cpu without --adapter".into(),
        })?;

        let fault: Arc<Mutex<Option<Fault>>> = Arc::default();
        let note = |fault: &Arc<Mutex<Option<Fault>>>, new: Fault| {
            let mut slot = fault.lock().unwrap_or_else(|e| e.into_inner());
            // A lost device explains every later error.
            if slot.is_none() || matches!(new, Fault::Lost(_)) {
                *slot = Some(new);
            }
        };
        let on_error = fault.clone();
        device.on_uncaptured_error(Arc::new(move |error| {
            let new = match error {
                wgpu::Error::OutOfMemory { .. } => Fault::OutOfMemory(one_line(&error.to_string())),
                wgpu::Error::Internal { .. } => Fault::Refused(one_line(&error.to_string())),
                other => Fault::Bug(one_line(&other.to_string())),
            };
            note(&on_error, new);
        }));
        let on_lost = fault.clone();
        device.set_device_lost_callback(move |reason, message| {
            note(&on_lost, Fault::Lost(one_line(&format!("{reason:?} {message}"))));
        });
        Ok(Gpu { device, queue, info, timestamps, watchdog: options.watchdog, fault })
    }

    /// Returns the adapter's name, kind and backend for messages.
    pub fn name(&self) -> String {
        format!("{} ({:?}, {:?})", self.info.name, self.info.device_type, self.info.backend)
    }

    /// Whether the device is software Vulkan on the host's processor.
    pub fn is_software(&self) -> bool {
        is_software(&self.info)
    }

    /// Whether the driver ends all loops of an invocation after 65,535 turns together. lavapipe does,
    /// without a word (`findings/lavapipe-loops.sh`).
    pub fn limits_loops(&self) -> bool {
        self.info.driver == "llvmpipe"
    }

    /// Checks whether the device has reported a fault.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::Memory`] or [`Error::Device`] if it has.
    ///
    /// # Panics
    /// If the device refused a command, which is a bug of this program.
    pub fn check(&self) -> Result<()> {
        let fault = || self.fault.lock().unwrap_or_else(|e| e.into_inner()).clone();
        if matches!(fault(), Some(Fault::Bug(_))) {
            // A lost device refuses commands before it reports its loss.
            let _ = self.device.poll(wgpu::PollType::Poll);
        }
        match fault() {
            None => Ok(()),
            Some(Fault::Lost(why)) => Err(Error::DeviceLost(why)),
            Some(Fault::OutOfMemory(why)) => Err(Error::Memory {
                what: format!("the device ({why})"),
                need: "more memory than it has".into(),
                budget: "exhausted".into(),
                fix: "lower the volume's or the image's size, or use --engine cpu".into(),
            }),
            Some(Fault::Refused(why)) => {
                Err(Error::device(format!("{} refuses to work ({why})", self.name()), "use --engine cpu"))
            }
            Some(Fault::Bug(why)) => panic!("the GPU refused a command: {why}"),
        }
    }

    /// Submits commands and waits until they are done.
    ///
    /// # Errors
    /// Errors of [`Gpu::wait`].
    pub fn run(&self, encoder: wgpu::CommandEncoder) -> Result<()> {
        let index = self.queue.submit([encoder.finish()]);
        self.wait(index)
    }

    /// Waits for a submission and all earlier ones.
    ///
    /// # Errors
    /// Errors of [`Gpu::check`]; [`Error::Watchdog`] if the wait takes longer than the watchdog allows.
    pub fn wait(&self, index: wgpu::SubmissionIndex) -> Result<()> {
        let waited = self
            .device
            .poll(wgpu::PollType::Wait { submission_index: Some(index), timeout: Some(self.watchdog) });
        self.check()?;
        match waited {
            Ok(_) => Ok(()),
            Err(wgpu::PollError::Timeout) => {
                // Dropping a queue waits until it is idle, which may never happen after a hang. A leaked
                // handle keeps the device until the process ends.
                std::mem::forget((self.device.clone(), self.queue.clone()));
                Err(Error::Watchdog { seconds: self.watchdog.as_secs_f64() })
            }
            Err(e) => Err(Error::DeviceLost(e.to_string())),
        }
    }

    /// Creates a command encoder.
    pub fn encoder(&self, label: &str) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(label) })
    }

    /// Creates something large. Devices limit the size of one allocation, and some do not tell the limit.
    ///
    /// # Errors
    /// [`Error::Device`] about `what` if the device has no memory for it.
    pub fn allocate<T>(&self, what: impl Fn() -> String, create: impl FnOnce() -> T) -> Result<T> {
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let made = create();
        match pollster::block_on(scope.pop()) {
            None => Ok(made),
            Some(_) => Err(Error::device(
                format!("{} is too large for {}, which has no memory for it", what(), self.name()),
                "lower its size, or use --engine cpu",
            )),
        }
    }

    /// Creates a buffer of `size` bytes.
    pub fn buffer(&self, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage,
            mapped_at_creation: false,
        })
    }

    /// Creates a buffer with contents. It has at least 16 bytes, because bindings must not be empty.
    pub fn buffer_with(&self, label: &str, bytes: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let size = (bytes.len() as u64).next_multiple_of(4).max(16);
        let buffer = self.buffer(label, size, usage | wgpu::BufferUsages::COPY_DST);
        if !bytes.is_empty() {
            self.queue.write_buffer(&buffer, 0, bytes);
        }
        buffer
    }
}

/// The error for an adapter `name` that is none of `names`.
fn unknown_adapter(name: &str, names: &[String]) -> Error {
    let what = format!("no adapter's name contains {name:?}");
    let fix = match names {
        [] => "there is none; leave out --adapter, or install a Vulkan driver (Debian: mesa-vulkan-drivers)"
            .into(),
        names => format!("there is {}; name one of these, or leave out --adapter", names.join(" and ")),
    };
    Error::NoAdapter { what, fix }
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
