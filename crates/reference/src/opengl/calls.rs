//! Calls into an OpenGL library that is loaded at run time: the only file of the program with `unsafe` code.
//!
//! EGL gives a context of the compatibility profile without display or window (`EGL_MESA_platform_surfaceless`), and
//! the addresses of OpenGL's functions. [`Gl`] is safe to use: it hands OpenGL only pointers to memory that is long
//! enough, draws only vertices that were loaded, and makes its context current before each call.
//!
//! Not handled: windows, shaders, textures; errors of single calls ([`Gl::failed`] is of all of them).
#![allow(unsafe_code)]

use std::cell::Cell;
use std::ffi::{CStr, c_char, c_void};
use std::marker::PhantomData;
use std::mem::{size_of_val, transmute};
use std::ptr::{null, null_mut};

use khronos_egl as egl;

use crate::opengl::constants as gl;
use halflight::pictures::Size;

/// A function of OpenGL for each line, by its name without `gl`.
macro_rules! functions {
    ($($name:ident($($argument:ty),*) $(-> $result:ty)?;)*) => {
        #[allow(non_snake_case)]
        struct Functions { $($name: unsafe extern "system" fn($($argument),*) $(-> $result)?,)* }

        impl Functions {
            /// All of them, or the name of the first that the library has not.
            ///
            /// # Safety
            /// The functions that `find` knows by these names have the types that OpenGL's headers give them.
            unsafe fn load(find: impl Fn(&str) -> Option<extern "system" fn()>) -> Result<Functions, String> {
                let found = |name: &'static str| find(name).ok_or_else(|| format!("there is no {name}"));
                Ok(Functions { $(
                    // SAFETY: a pointer to a function becomes one of the type that OpenGL's headers give it.
                    $name: unsafe {
                        transmute::<extern "system" fn(), unsafe extern "system" fn($($argument),*) $(-> $result)?>(
                            found(concat!("gl", stringify!($name)))?,
                        )
                    },
                )* })
            }
        }
    };
}

functions! {
    BindBuffer(u32, u32);
    BindFramebuffer(u32, u32);
    BindRenderbuffer(u32, u32);
    BufferData(u32, isize, *const c_void, u32);
    CheckFramebufferStatus(u32) -> u32;
    ClampColor(u32, u32);
    Clear(u32);
    DrawArrays(u32, i32, i32);
    Enable(u32);
    EnableClientState(u32);
    FramebufferRenderbuffer(u32, u32, u32, u32);
    GenBuffers(i32, *mut u32);
    GenFramebuffers(i32, *mut u32);
    GenRenderbuffers(i32, *mut u32);
    GetError() -> u32;
    GetIntegerv(u32, *mut i32);
    GetString(u32) -> *const c_char;
    LightModelfv(u32, *const f32);
    Lightfv(u32, u32, *const f32);
    LoadMatrixf(*const f32);
    Materialfv(u32, u32, *const f32);
    MatrixMode(u32);
    NormalPointer(u32, i32, *const c_void);
    ReadPixels(i32, i32, i32, i32, u32, u32, *mut c_void);
    RenderbufferStorage(u32, u32, i32, i32);
    VertexPointer(i32, u32, i32, *const c_void);
    Viewport(i32, i32, i32, i32);
}

/// A vertex: position and normal.
pub(crate) type Vertex = [[f32; 3]; 2];

/// An OpenGL context of this thread.
pub(crate) struct Gl {
    egl: egl::DynamicInstance<egl::EGL1_5>,
    display: egl::Display,
    context: egl::Context,
    functions: Functions,
    /// Vertices loaded.
    vertices: Cell<usize>,
    /// Width and height of what is drawn on.
    size: Cell<Size>,
    /// A context belongs to one thread.
    thread: PhantomData<*const ()>,
}

impl Gl {
    /// A context without a display.
    ///
    /// # Errors
    /// What is missing, in words.
    pub fn open() -> Result<Gl, String> {
        // SAFETY: a library of this name that has EGL's functions is an EGL library.
        let egl = unsafe { egl::DynamicInstance::<egl::EGL1_5>::load_required() }.map_err(|e| e.to_string())?;
        let said = |e: egl::Error| e.to_string();
        // SAFETY: the surfaceless platform takes no native display.
        let display = unsafe {
            egl.get_platform_display(gl::EGL_PLATFORM_SURFACELESS_MESA, null_mut(), &[egl::ATTRIB_NONE])
                .map_err(said)?
        };
        egl.initialize(display).map_err(said)?;
        egl.bind_api(egl::OPENGL_API).map_err(said)?;
        let wanted = [egl::RENDERABLE_TYPE, egl::OPENGL_BIT, egl::SURFACE_TYPE, 0, egl::NONE];
        let config = egl.choose_first_config(display, &wanted).map_err(said)?;
        let config = config.ok_or("EGL has no configuration for OpenGL")?;
        let profile = [egl::CONTEXT_MAJOR_VERSION, 2, egl::CONTEXT_MINOR_VERSION, 1, egl::NONE];
        let context = egl.create_context(display, config, None, &profile).map_err(said)?;
        egl.make_current(display, None, None, Some(context)).map_err(said)?;
        // SAFETY: EGL knows OpenGL's functions by their names.
        let functions = unsafe { Functions::load(|name| egl.get_proc_address(name)) }?;
        let (vertices, size) = (Cell::new(0), Cell::new(Size::default()));
        Ok(Gl { egl, display, context, functions, vertices, size, thread: PhantomData })
    }

    /// OpenGL's functions, this context being current: another one of the thread may have been so.
    fn functions(&self) -> &Functions {
        let current = self.egl.make_current(self.display, None, None, Some(self.context));
        assert!(current.is_ok(), "an OpenGL context that was current can be made so again");
        &self.functions
    }

    /// What OpenGL calls itself.
    pub fn string(&self, name: u32) -> String {
        // SAFETY: null, or a string that lives as long as the context.
        unsafe {
            let text = (self.functions().GetString)(name);
            if text.is_null() { String::new() } else { CStr::from_ptr(text).to_string_lossy().into_owned() }
        }
    }

    /// The number of lights that there may be.
    pub fn most_lights(&self) -> usize {
        let mut value = [0; 16];
        // SAFETY: no number of OpenGL's has more than 16 parts.
        unsafe { (self.functions().GetIntegerv)(gl::MAX_LIGHTS, value.as_mut_ptr()) };
        usize::try_from(value[0]).unwrap_or(0)
    }

    /// Whether any call failed since the last such question.
    pub fn failed(&self) -> bool {
        // SAFETY: takes and leaves nothing.
        unsafe { (self.functions().GetError)() != gl::NO_ERROR }
    }

    /// Turns a capability on.
    pub fn enable(&self, capability: u32) {
        // SAFETY: a number that is no capability is an error and no more.
        unsafe { (self.functions().Enable)(capability) }
    }

    /// A parameter of a light, of four numbers or fewer.
    pub fn light(&self, light: u32, name: u32, values: [f32; 4]) {
        // SAFETY: no parameter of a light has more than four numbers.
        unsafe { (self.functions().Lightfv)(light, name, values.as_ptr()) }
    }

    /// A parameter of the lighting model.
    pub fn light_model(&self, name: u32, values: [f32; 4]) {
        // SAFETY: no parameter of the lighting model has more than four numbers.
        unsafe { (self.functions().LightModelfv)(name, values.as_ptr()) }
    }

    /// A parameter of the material of one side.
    pub fn material(&self, side: u32, name: u32, values: [f32; 4]) {
        // SAFETY: no parameter of a material has more than four numbers.
        unsafe { (self.functions().Materialfv)(side, name, values.as_ptr()) }
    }

    /// One of the two matrices, column by column.
    pub fn matrix(&self, which: u32, columns: [f32; 16]) {
        let f = self.functions();
        // SAFETY: a matrix has sixteen numbers.
        unsafe {
            (f.MatrixMode)(which);
            (f.LoadMatrixf)(columns.as_ptr());
        }
    }

    /// Loads the vertices that are drawn from then on.
    pub fn load(&self, vertices: &[Vertex]) {
        let f = self.functions();
        let stride = size_of::<Vertex>() as i32;
        let mut buffer = 0;
        // SAFETY: OpenGL copies as many bytes as the slice has; both arrays lie in the buffer, normals after positions.
        unsafe {
            (f.GenBuffers)(1, &mut buffer);
            (f.BindBuffer)(gl::ARRAY_BUFFER, buffer);
            (f.BufferData)(gl::ARRAY_BUFFER, size_of_val(vertices) as isize, vertices.as_ptr().cast(), gl::STATIC_DRAW);
            (f.VertexPointer)(3, gl::FLOAT, stride, null());
            (f.NormalPointer)(gl::FLOAT, stride, size_of::<[f32; 3]>() as *const c_void);
            (f.EnableClientState)(gl::VERTEX_ARRAY);
            (f.EnableClientState)(gl::NORMAL_ARRAY);
        }
        self.vertices.set(vertices.len());
    }

    /// Draws triangles of some of the vertices loaded.
    ///
    /// # Panics
    /// If there are not so many.
    pub fn draw(&self, vertices: std::ops::Range<usize>) {
        assert!(vertices.start <= vertices.end && vertices.end <= self.vertices.get() && vertices.end < 1 << 31);
        // SAFETY: all of these vertices were loaded.
        unsafe { (self.functions().DrawArrays)(gl::TRIANGLES, vertices.start as i32, vertices.len() as i32) }
    }

    /// Makes something to draw on, colours being kept as `format` has them; whether there is such a thing.
    pub fn draw_on(&self, format: u32, size: Size) -> bool {
        let f = self.functions();
        let (wide, high) = (size.width as i32, size.height as i32);
        let (mut frame, mut buffers) = (0, [0; 2]);
        // SAFETY: one name is written, and two; everything else is numbers.
        unsafe {
            (f.GenFramebuffers)(1, &mut frame);
            (f.BindFramebuffer)(gl::FRAMEBUFFER, frame);
            (f.GenRenderbuffers)(2, buffers.as_mut_ptr());
            for (buffer, (format, place)) in buffers
                .into_iter()
                .zip([(format, gl::COLOR_ATTACHMENT0), (gl::DEPTH_COMPONENT24, gl::DEPTH_ATTACHMENT)])
            {
                (f.BindRenderbuffer)(gl::RENDERBUFFER, buffer);
                (f.RenderbufferStorage)(gl::RENDERBUFFER, format, wide, high);
                (f.FramebufferRenderbuffer)(gl::FRAMEBUFFER, place, gl::RENDERBUFFER, buffer);
            }
            (f.Viewport)(0, 0, wide, high);
            // Colours of vertices beyond 1 stay what they are, where colours are floating point.
            (f.ClampColor)(gl::CLAMP_VERTEX_COLOR, 0);
            let complete = (f.CheckFramebufferStatus)(gl::FRAMEBUFFER) == gl::FRAMEBUFFER_COMPLETE;
            self.size.set(if complete { size } else { Size::default() });
            complete
        }
    }

    /// Makes everything black and far away.
    pub fn clear(&self) {
        // SAFETY: takes numbers only.
        unsafe { (self.functions().Clear)(gl::COLOR_BUFFER_BIT | gl::DEPTH_BUFFER_BIT) }
    }

    /// The colours drawn, row by row from below.
    pub fn read(&self) -> Vec<[f32; 3]> {
        let Size { width, height } = self.size.get();
        let mut pixels = vec![[0.0; 3]; width * height];
        // SAFETY: rows of 12-byte pixels need no padding to a multiple of 4 bytes, so they fill the vector exactly.
        unsafe {
            (self.functions().ReadPixels)(
                0,
                0,
                width as i32,
                height as i32,
                gl::RGB,
                gl::FLOAT,
                pixels.as_mut_ptr().cast(),
            );
        }
        pixels
    }
}

impl Drop for Gl {
    fn drop(&mut self) {
        // The display is shared by all contexts of the process and stays open.
        let _ = self.egl.make_current(self.display, None, None, None);
        let _ = self.egl.destroy_context(self.display, self.context);
    }
}
