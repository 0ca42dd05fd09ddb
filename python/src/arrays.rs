//! Arrays both ways: memory of Rust as views that cannot be written to, results without a copy, and inputs.
//!
//! ```text
//! &[Light] of n patches    float32 (n, 2, 3)       invisible, visible; red, green, blue
//! &[Rgb]                   float32 (n, 3)          a picture: (height, width, 3)
//! ```
//!
//! The only unsafe code of the module is here. It rests on the layouts of [`Light`] and [`Rgb`], which are asserted,
//! and on owners that never change: views hold them by Python's count of references.

use halflight::Light;
use halflight::light::Rgb;
use halflight::pictures::Picture;
use numpy::ndarray::{ArrayView, Dimension, ShapeBuilder};
use numpy::npyffi::flags::NPY_ARRAY_WRITEABLE;
use numpy::{Element, PyArray, PyArray1, PyArray2, PyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;

const _: () = assert!(size_of::<Rgb>() == 12 && align_of::<Rgb>() == 4);
const _: () = assert!(size_of::<Light>() == 24 && align_of::<Light>() == 4);

/// A view of numbers that `owner` holds for as long as it lives, and does not change.
pub fn view<'py, T: Element, D: Dimension>(
    owner: Bound<'py, PyAny>,
    numbers: &[T],
    shape: impl ShapeBuilder<Dim = D>,
) -> Bound<'py, PyArray<T, D>> {
    let shaped =
        ArrayView::from_shape(shape.into_shape_with_order(), numbers).expect("as many numbers as the shape has");
    // SAFETY: the array holds the owner, a frozen class, whose lists neither move nor change; it is made read-only.
    let array = unsafe { PyArray::borrow_from_array(&shaped, owner) };
    // SAFETY: nobody else knows the array yet. Its borrow is not asked for: others may be reading the same memory.
    unsafe { (*array.as_array_ptr()).fields.flags &= !NPY_ARRAY_WRITEABLE };
    array
}

/// The numbers of lights, one after another.
pub fn numbers_of_lights(lights: &[Light]) -> &[f32] {
    // SAFETY: a light is six numbers, as asserted above.
    unsafe { std::slice::from_raw_parts(lights.as_ptr().cast(), 6 * lights.len()) }
}

/// The numbers of colours, one after another.
pub fn numbers_of_colours(colours: &[Rgb]) -> &[f32] {
    // SAFETY: a colour is three numbers, as asserted above.
    unsafe { std::slice::from_raw_parts(colours.as_ptr().cast(), 3 * colours.len()) }
}

/// Numbers as lights, six each.
pub fn lights_of_numbers(numbers: &[f32]) -> &[Light] {
    // SAFETY: a light is six numbers, as asserted above; what is left over is left out.
    unsafe { std::slice::from_raw_parts(numbers.as_ptr().cast(), numbers.len() / 6) }
}

/// A view of lights: (n, 2, 3).
pub fn lights<'py>(owner: Bound<'py, PyAny>, lights: &[Light]) -> Bound<'py, PyArray3<f32>> {
    view(owner, numbers_of_lights(lights), (lights.len(), 2, 3))
}

/// A view of colours: (n, 3).
pub fn colours<'py>(owner: Bound<'py, PyAny>, colours: &[Rgb]) -> Bound<'py, PyArray2<f32>> {
    view(owner, numbers_of_colours(colours), (colours.len(), 3))
}

/// A view of a picture: (height, width, 3).
pub fn picture<'py>(owner: Bound<'py, PyAny>, picture: &Picture) -> Bound<'py, PyArray3<f32>> {
    view(owner, numbers_of_colours(&picture.pixels), (picture.height, picture.width, 3))
}

/// The numbers of a result as an array of its own, without a copy.
pub fn taken<'py>(py: Python<'py>, lights: Vec<Light>) -> Bound<'py, PyArray1<f32>> {
    let mut lights = std::mem::ManuallyDrop::new(lights);
    let (start, length, capacity) = (lights.as_mut_ptr(), lights.len(), lights.capacity());
    // SAFETY: the memory of six times as many numbers, of the alignment of one, is that of the lights.
    let numbers = unsafe { Vec::from_raw_parts(start.cast::<f32>(), 6 * length, 6 * capacity) };
    PyArray1::from_vec(py, numbers)
}

/// A picture of an array (height, width, 3).
pub fn picture_of(array: &numpy::PyReadonlyArray3<f32>) -> Picture {
    let array = array.as_array();
    let (height, width) = (array.shape()[0], array.shape()[1]);
    Picture::from_fn(width, height, |x, y| Rgb::new(array[[y, x, 0]], array[[y, x, 1]], array[[y, x, 2]]))
}
