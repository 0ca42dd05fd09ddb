//! The queries of rays to faces, whatever holds these: the first meeting, every one, whether there is none.
//!
//! Each is compiled once for every level of vector instructions, and the level is chosen at run time. Results do not
//! depend on it: Rust never fuses a multiplication with an addition by itself.
//!
//! Not handled: registers of more than eight lanes; one lane at a time takes their place.

use std::ops::ControlFlow;

use pulp::{Arch, Scalar, Simd, WithSimd};

use crate::rays::lanes::LANES;
use crate::rays::triangle::{Hit, Meeting, Query};

/// Faces that find their meetings with a ray.
pub(crate) trait Faces: Sized {
    /// The level of vector instructions to be used.
    fn arch(&self) -> Arch;

    /// The first meeting, by instructions of one level.
    fn first<S: Simd>(&self, simd: S, query: &Query) -> Option<Hit>;

    /// Calls `meet` with every meeting and its face, in no order, edges counted once for each face, until it breaks.
    fn each<S: Simd>(
        &self,
        simd: S,
        query: &Query,
        meet: impl FnMut(Meeting, u32) -> ControlFlow<()>,
    ) -> ControlFlow<()>;

    /// Whether there is no meeting, by instructions of one level.
    fn clear<S: Simd>(&self, simd: S, query: &Query) -> bool;

    /// The first meeting.
    #[inline]
    fn closest(&self, query: &Query) -> Option<Hit> {
        self.arch().dispatch(Closest(self, query))
    }

    /// Whether there is no meeting.
    #[inline]
    fn is_clear(&self, query: &Query) -> bool {
        self.arch().dispatch(IsClear(self, query))
    }

    /// Appends every meeting to `out`, in no order, edges counted once for each face; false as soon as an opaque face
    /// is met.
    #[inline]
    fn all_unless(&self, opaque: impl Fn(u32) -> bool, query: &Query, out: &mut Vec<Hit>) -> bool {
        self.arch().dispatch(AllUnless(self, opaque, query, out))
    }
}

struct Closest<'a, F>(&'a F, &'a Query);

impl<F: Faces> WithSimd for Closest<'_, F> {
    type Output = Option<Hit>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Option<Hit> {
        if S::F32_LANES > LANES { self.0.first(Scalar::new(), self.1) } else { self.0.first(simd, self.1) }
    }
}

struct IsClear<'a, F>(&'a F, &'a Query);

impl<F: Faces> WithSimd for IsClear<'_, F> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        if S::F32_LANES > LANES { self.0.clear(Scalar::new(), self.1) } else { self.0.clear(simd, self.1) }
    }
}

struct AllUnless<'a, F, O>(&'a F, O, &'a Query, &'a mut Vec<Hit>);

impl<F: Faces, O: Fn(u32) -> bool> WithSimd for AllUnless<'_, F, O> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        if S::F32_LANES > LANES {
            return self.with_simd(Scalar::new());
        }
        let AllUnless(faces, opaque, query, out) = self;
        let passed = faces.each(simd, query, |meeting, face| {
            if opaque(face) {
                return ControlFlow::Break(());
            }
            out.push(meeting.hit(face));
            ControlFlow::Continue(())
        });
        passed.is_continue()
    }
}
