//! OpenGL's and EGL's numbers, by the names that their headers have for them (`GL/gl.h`, `GL/glext.h`, `EGL/eglext.h`).
//!
//! Not handled: all that the fixed-function picture of a scene does not need.

pub(crate) const EGL_PLATFORM_SURFACELESS_MESA: u32 = 0x31DD;

pub(crate) const COLOR_BUFFER_BIT: u32 = 0x4000;
pub(crate) const DEPTH_BUFFER_BIT: u32 = 0x0100;
pub(crate) const TRIANGLES: u32 = 0x0004;
pub(crate) const NO_ERROR: u32 = 0;

pub(crate) const DEPTH_TEST: u32 = 0x0B71;
pub(crate) const LIGHTING: u32 = 0x0B50;
pub(crate) const LIGHT0: u32 = 0x4000;
pub(crate) const MAX_LIGHTS: u32 = 0x0D31;

pub(crate) const LIGHT_MODEL_LOCAL_VIEWER: u32 = 0x0B51;
pub(crate) const LIGHT_MODEL_TWO_SIDE: u32 = 0x0B52;
pub(crate) const LIGHT_MODEL_AMBIENT: u32 = 0x0B53;

pub(crate) const FRONT: u32 = 0x0404;
pub(crate) const BACK: u32 = 0x0405;
pub(crate) const AMBIENT: u32 = 0x1200;
pub(crate) const DIFFUSE: u32 = 0x1201;
pub(crate) const SPECULAR: u32 = 0x1202;
pub(crate) const POSITION: u32 = 0x1203;
pub(crate) const SPOT_DIRECTION: u32 = 0x1204;
pub(crate) const SPOT_EXPONENT: u32 = 0x1205;
pub(crate) const SPOT_CUTOFF: u32 = 0x1206;
pub(crate) const CONSTANT_ATTENUATION: u32 = 0x1207;
pub(crate) const LINEAR_ATTENUATION: u32 = 0x1208;
pub(crate) const QUADRATIC_ATTENUATION: u32 = 0x1209;
pub(crate) const EMISSION: u32 = 0x1600;
pub(crate) const SHININESS: u32 = 0x1601;

pub(crate) const MODELVIEW: u32 = 0x1700;
pub(crate) const PROJECTION: u32 = 0x1701;

pub(crate) const RENDERER: u32 = 0x1F01;
pub(crate) const VERSION: u32 = 0x1F02;

pub(crate) const ARRAY_BUFFER: u32 = 0x8892;
pub(crate) const STATIC_DRAW: u32 = 0x88E4;
pub(crate) const VERTEX_ARRAY: u32 = 0x8074;
pub(crate) const NORMAL_ARRAY: u32 = 0x8075;

pub(crate) const FRAMEBUFFER: u32 = 0x8D40;
pub(crate) const RENDERBUFFER: u32 = 0x8D41;
pub(crate) const COLOR_ATTACHMENT0: u32 = 0x8CE0;
pub(crate) const DEPTH_ATTACHMENT: u32 = 0x8D00;
pub(crate) const FRAMEBUFFER_COMPLETE: u32 = 0x8CD5;
pub(crate) const RGBA8: u32 = 0x8058;
pub(crate) const RGBA32F: u32 = 0x8814;
pub(crate) const DEPTH_COMPONENT24: u32 = 0x81A6;
pub(crate) const CLAMP_VERTEX_COLOR: u32 = 0x891A;

pub(crate) const RGB: u32 = 0x1907;
pub(crate) const FLOAT: u32 = 0x1406;
