//! Open Image Denoise 2, loaded when it is asked for: from the folder `OIDN_DIR` or its `lib`, else
//! from where the system looks for libraries.
//!
//! Names and numbers are those of the library's C interface, `oidn.h` of version 2.

use super::Images;
use lanecast_model::scene::Rgb;
use libloading::Symbol;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::path::{Path, PathBuf};
use std::ptr::null;

/// `OIDN_DEVICE_TYPE_CPU`, and `OIDN_FORMAT_FLOAT3`.
const CPU: c_int = 1;
const FLOAT3: c_int = 3;

type Handle = *mut c_void;
type Name = *const c_char;
type NewDevice = unsafe extern "C" fn(c_int) -> Handle;
type NewFilter = unsafe extern "C" fn(Handle, Name) -> Handle;
type Act = unsafe extern "C" fn(Handle);
type SetInt = unsafe extern "C" fn(Handle, Name, c_int);
type GetInt = unsafe extern "C" fn(Handle, Name) -> c_int;
type SetBool = unsafe extern "C" fn(Handle, Name, bool);
type GetError = unsafe extern "C" fn(Handle, *mut Name) -> c_int;
/// Filter, name, pointer, format, width, height, and offset and strides in bytes, 0 of packed rows.
type SetImage =
    unsafe extern "C" fn(Handle, Name, *mut c_void, c_int, usize, usize, usize, usize, usize);

#[cfg(target_os = "windows")]
const FILE: &str = "OpenImageDenoise.dll";
#[cfg(target_os = "macos")]
const FILE: &str = "libOpenImageDenoise.2.dylib";
#[cfg(not(any(target_os = "windows", target_os = "macos")))]
const FILE: &str = "libOpenImageDenoise.so.2";

/// The loaded library.
pub struct Library(libloading::Library);

impl Library {
    /// Loads the library; fails with the remedy if it is not found.
    pub fn load() -> Result<Library, String> {
        let dir = std::env::var_os("OIDN_DIR").filter(|dir| !dir.is_empty());
        let places = match &dir {
            Some(dir) => vec![
                Path::new(dir).join("lib").join(FILE),
                Path::new(dir).join(FILE),
            ],
            None => vec![PathBuf::from(FILE)],
        };
        let found = places.iter().find(|place| place.is_file());
        let place = found.unwrap_or(&places[0]);
        // SAFETY: it is the library that the user names, and its initialisers ask for nothing.
        unsafe { libloading::Library::new(place) }
            .map(Library)
            .map_err(|error| {
                let why = std::error::Error::source(&error).map(ToString::to_string);
                let why = why.unwrap_or_else(|| error.to_string());
                format!(
                    "Open Image Denoise 2 is not loaded: {why}; set OIDN_DIR to the folder that \
                     holds lib/{FILE}, or leave out --denoise"
                )
            })
    }

    /// Filters a picture by its guides, which are filtered first, and what shines. Returns both, and
    /// the library's version.
    pub fn filter(
        &self,
        images: &Images,
        threads: Option<u32>,
    ) -> Result<([Vec<Rgb>; 2], String), String> {
        let device = Device::new(self, threads)?;
        let size = (images.width as usize, images.height as usize);
        let mut albedo = images.albedo.to_vec();
        let mut normal = images.normal.to_vec();
        let mut color = images.color.to_vec();
        let mut shine = images.shine.to_vec();
        device.run(size, &[(c"albedo", images.albedo)], &mut albedo)?;
        device.run(size, &[(c"normal", images.normal)], &mut normal)?;
        device.run(size, &[(c"albedo", images.shine)], &mut shine)?;
        let all = [
            (c"color", images.color),
            (c"albedo", &albedo[..]),
            (c"normal", &normal[..]),
        ];
        device.run(size, &all, &mut color)?;
        Ok(([color, shine], device.version()?))
    }

    /// Finds a function of the library.
    fn function<F>(&self, name: &str) -> Result<Symbol<'_, F>, String> {
        // SAFETY: each caller names the type that `oidn.h` declares.
        unsafe { self.0.get(name.as_bytes()) }
            .map_err(|_| format!("the library has no {name}; version 2 has it"))
    }
}

/// The processor as a device.
struct Device<'l> {
    library: &'l Library,
    handle: Handle,
}

impl<'l> Device<'l> {
    /// Makes the device, of so many threads.
    fn new(library: &'l Library, threads: Option<u32>) -> Result<Device<'l>, String> {
        let make = library.function::<NewDevice>("oidnNewDevice")?;
        let set_int = library.function::<SetInt>("oidnSetDeviceInt")?;
        let set_bool = library.function::<SetBool>("oidnSetDeviceBool")?;
        let commit = library.function::<Act>("oidnCommitDevice")?;
        // SAFETY: the call takes a number.
        let handle = unsafe { make(CPU) };
        let device = Device { library, handle };
        if handle.is_null() {
            device.check()?;
            return Err("it has no device for this processor".into());
        }
        // SAFETY: the device is alive, and names are C strings that the calls do not keep.
        unsafe {
            if let Some(threads) = threads {
                set_int(handle, c"numThreads".as_ptr(), threads as c_int);
            }
            set_bool(handle, c"setAffinity".as_ptr(), false);
            commit(handle);
        }
        device.check()?;
        Ok(device)
    }

    /// Returns the library's version.
    fn version(&self) -> Result<String, String> {
        let get = self.library.function::<GetInt>("oidnGetDeviceInt")?;
        // SAFETY: the device is alive.
        let number = unsafe { get(self.handle, c"version".as_ptr()) };
        let (major, minor, patch) = (number / 10_000, number / 100 % 100, number % 100);
        Ok(format!("{major}.{minor}.{patch}"))
    }

    /// Runs the filter for ray tracing over images of one size into `output`.
    fn run(
        &self,
        (width, height): (usize, usize),
        inputs: &[(&CStr, &[Rgb])],
        output: &mut [Rgb],
    ) -> Result<(), String> {
        let make = self.library.function::<NewFilter>("oidnNewFilter")?;
        let set_image = self
            .library
            .function::<SetImage>("oidnSetSharedFilterImage")?;
        let set_bool = self.library.function::<SetBool>("oidnSetFilterBool")?;
        let commit = self.library.function::<Act>("oidnCommitFilter")?;
        let execute = self.library.function::<Act>("oidnExecuteFilter")?;
        let release = self.library.function::<Act>("oidnReleaseFilter")?;
        let pixels = width * height;
        let lengths = inputs.iter().map(|(_, image)| image.len());
        if lengths.chain([output.len()]).any(|len| len != pixels) {
            return Err("an image is not of the picture's size".into());
        }
        let images = inputs
            .iter()
            .map(|(name, image)| (*name, image.as_ptr().cast_mut().cast()));
        let images = images.chain([(c"output", output.as_mut_ptr().cast::<c_void>())]);
        // SAFETY: the device is alive; images have `pixels` rows of three numbers, outlive the
        // filter, which is released here, and the library writes to `output` alone.
        unsafe {
            let filter = make(self.handle, c"RT".as_ptr());
            if filter.is_null() {
                return self.check();
            }
            for (name, at) in images {
                set_image(filter, name.as_ptr(), at, FLOAT3, width, height, 0, 0, 0);
            }
            if inputs.len() > 1 {
                set_bool(filter, c"hdr".as_ptr(), true);
                set_bool(filter, c"cleanAux".as_ptr(), true);
            }
            commit(filter);
            execute(filter);
            release(filter);
        }
        self.check()
    }

    /// Returns the error that the library has noted, if any.
    fn check(&self) -> Result<(), String> {
        let get = self.library.function::<GetError>("oidnGetDeviceError")?;
        let mut message: Name = null();
        // SAFETY: without a device the call tells of this thread's; the message is a C string that
        // lives until the next call.
        let text = unsafe {
            match get(self.handle, &raw mut message) {
                0 => return Ok(()),
                _ if message.is_null() => "it failed".into(),
                _ => CStr::from_ptr(message).to_string_lossy().into_owned(),
            }
        };
        Err(text)
    }
}

impl Drop for Device<'_> {
    fn drop(&mut self) {
        if self.handle.is_null() {
            return;
        }
        if let Ok(release) = self.library.function::<Act>("oidnReleaseDevice") {
            // SAFETY: the device is alive, and nobody has it after this.
            unsafe { release(self.handle) };
        }
    }
}
