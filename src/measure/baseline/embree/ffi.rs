//! Embree 3's C interface: the functions that `bench` calls, and the layouts they read.
//!
//! The declarations follow the headers of 3.13 (`rtcore_*.h`) as distributions
//! configure them: one level of instancing, no minimal curve width. Rays and hits of N
//! lanes are columns of N numbers in a fixed order, so one generic type serves all
//! widths; the test below checks their sizes against the headers'.

use std::ffi::{c_char, c_int, c_uint, c_void};

/// An opaque Embree object.
pub type Handle = *mut c_void;

pub const VERTEX_BUFFER: c_uint = 1;
pub const INDEX_BUFFER: c_uint = 0;
pub const FLOAT3: c_uint = 0x9003;
pub const UINT3: c_uint = 0x5003;
pub const TRIANGLES: c_uint = 0;
pub const COHERENT: c_uint = 1;
/// Scene flag: watertight edges, for somewhat slower queries.
pub const ROBUST: c_uint = 1 << 2;
/// The id of no geometry or instance.
pub const INVALID: u32 = u32::MAX;

#[repr(C)]
pub struct Context {
    flags: c_uint,
    filter: *const c_void,
    instance: [c_uint; 1],
}

impl Context {
    /// Initialises a context as `rtcInitIntersectContext` does, with these flags.
    pub fn new(flags: c_uint) -> Context {
        Context {
            flags,
            filter: std::ptr::null(),
            instance: [INVALID],
        }
    }
}

/// N rays in columns: `RTCRay`, `RTCRay4`, `RTCRay8` and `RTCRay16`.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RayN<const N: usize> {
    pub org: [[f32; N]; 3],
    pub t_near: [f32; N],
    pub dir: [[f32; N]; 3],
    pub time: [f32; N],
    pub t_far: [f32; N],
    pub mask: [u32; N],
    pub id: [u32; N],
    pub flags: [u32; N],
}

#[derive(Clone, Copy)]
#[repr(C)]
pub struct HitN<const N: usize> {
    pub ng: [[f32; N]; 3],
    pub uv: [[f32; N]; 2],
    pub primitive: [u32; N],
    pub geometry: [u32; N],
    pub instance: [u32; N],
}

#[derive(Clone, Copy)]
#[repr(C)]
pub struct RayHitN<const N: usize> {
    pub ray: RayN<N>,
    pub hit: HitN<N>,
}

impl<const N: usize> RayN<N> {
    pub const EMPTY: RayN<N> = RayN {
        org: [[0.0; N]; 3],
        t_near: [0.0; N],
        dir: [[0.0; N]; 3],
        time: [0.0; N],
        t_far: [-1.0; N],
        mask: [u32::MAX; N],
        id: [0; N],
        flags: [0; N],
    };
}

impl<const N: usize> RayHitN<N> {
    pub const EMPTY: RayHitN<N> = RayHitN {
        ray: RayN::EMPTY,
        hit: HitN {
            ng: [[0.0; N]; 3],
            uv: [[0.0; N]; 2],
            primitive: [INVALID; N],
            geometry: [INVALID; N],
            instance: [INVALID; N],
        },
    };
}

/// The alignment that Embree requires of single rays.
#[derive(Clone, Copy)]
#[repr(C, align(16))]
pub struct Aligned16<T>(pub T);

/// The alignment that Embree requires of packets of 16; narrower packets need less.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub struct Aligned64<T>(pub T);

/// Arguments: `valid` (−1 or 0 per lane), scene, context, and rays with or without
/// hits.
pub type PacketCall = unsafe extern "C" fn(*const c_int, Handle, *mut Context, *mut c_void);
pub type MemoryMonitor = extern "C" fn(*mut c_void, isize, bool) -> bool;

#[link(name = "embree3")]
unsafe extern "C" {
    pub fn rtcNewDevice(config: *const c_char) -> Handle;
    pub fn rtcReleaseDevice(device: Handle);
    pub fn rtcGetDeviceError(device: Handle) -> c_uint;
    pub fn rtcGetDeviceProperty(device: Handle, property: c_uint) -> isize;
    pub fn rtcSetDeviceMemoryMonitorFunction(
        device: Handle,
        monitor: Option<MemoryMonitor>,
        user: *mut c_void,
    );

    pub fn rtcNewGeometry(device: Handle, kind: c_uint) -> Handle;
    pub fn rtcSetSharedGeometryBuffer(
        geometry: Handle,
        kind: c_uint,
        slot: c_uint,
        format: c_uint,
        data: *const c_void,
        offset: usize,
        stride: usize,
        count: usize,
    );
    pub fn rtcSetGeometryBuildQuality(geometry: Handle, quality: c_uint);
    pub fn rtcCommitGeometry(geometry: Handle);
    pub fn rtcReleaseGeometry(geometry: Handle);

    pub fn rtcNewScene(device: Handle) -> Handle;
    pub fn rtcSetSceneFlags(scene: Handle, flags: c_uint);
    pub fn rtcSetSceneBuildQuality(scene: Handle, quality: c_uint);
    pub fn rtcAttachGeometry(scene: Handle, geometry: Handle) -> c_uint;
    pub fn rtcCommitScene(scene: Handle);
    pub fn rtcReleaseScene(scene: Handle);

    pub fn rtcIntersect1(scene: Handle, context: *mut Context, rays: *mut c_void);
    pub fn rtcIntersect4(v: *const c_int, scene: Handle, c: *mut Context, rays: *mut c_void);
    pub fn rtcIntersect8(v: *const c_int, scene: Handle, c: *mut Context, rays: *mut c_void);
    pub fn rtcIntersect16(v: *const c_int, scene: Handle, c: *mut Context, rays: *mut c_void);
    pub fn rtcIntersect1M(
        scene: Handle,
        context: *mut Context,
        rays: *mut c_void,
        count: c_uint,
        stride: usize,
    );
    pub fn rtcIntersectNM(
        scene: Handle,
        context: *mut Context,
        packets: *mut c_void,
        lanes: c_uint,
        count: c_uint,
        stride: usize,
    );
    pub fn rtcOccluded1(scene: Handle, context: *mut Context, rays: *mut c_void);
    pub fn rtcOccluded4(v: *const c_int, scene: Handle, c: *mut Context, rays: *mut c_void);
    pub fn rtcOccluded8(v: *const c_int, scene: Handle, c: *mut Context, rays: *mut c_void);
    pub fn rtcOccluded16(v: *const c_int, scene: Handle, c: *mut Context, rays: *mut c_void);
    pub fn rtcOccluded1M(
        scene: Handle,
        context: *mut Context,
        rays: *mut c_void,
        count: c_uint,
        stride: usize,
    );
    pub fn rtcOccludedNM(
        scene: Handle,
        context: *mut Context,
        packets: *mut c_void,
        lanes: c_uint,
        count: c_uint,
        stride: usize,
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layouts_are_those_of_the_headers() {
        // RTCRay has 48 bytes and RTCHit 32; packets are N times as long.
        assert_eq!(size_of::<Aligned16<RayN<1>>>(), 48);
        assert_eq!(size_of::<Aligned16<RayHitN<1>>>(), 80);
        assert_eq!(size_of::<Aligned64<RayN<16>>>(), 768);
        assert_eq!(size_of::<Aligned64<RayHitN<4>>>(), 320);
        assert_eq!(size_of::<Aligned64<RayHitN<8>>>(), 640);
        assert_eq!(size_of::<Aligned64<RayHitN<16>>>(), 1280);
        assert_eq!(std::mem::offset_of!(RayN<1>, t_far), 32);
        assert_eq!(std::mem::offset_of!(RayHitN<8>, hit), 384);
        assert_eq!(std::mem::offset_of!(HitN<16>, primitive), 320);
        assert_eq!(size_of::<Context>(), 24);
    }
}
