//! An answer: a picture, its bounce orders and means, with all that is known of their errors.
//!
//! Verdicts rest on answers, and the methods of the other kind are held against them. Not handled: how it was found.

use crate::pictures::Picture;
use crate::study::compare::truth::Truth;

/// What a method says when it has done its best.
#[derive(Clone, Debug, Default)]
pub struct Answer {
    /// The method.
    pub name: &'static str,
    /// How fine: patches and rays, or samples a pixel.
    pub effort: String,
    /// All bounces.
    pub picture: Picture,
    /// Standard error of each pixel and channel.
    pub noise: Picture,
    /// Estimated size of the error that more samples do not reduce, per pixel and channel; none for a path tracer.
    pub systematic: Option<Picture>,
    /// Bounces n = 0 to [`ORDERS`](crate::study::compare::ORDERS).
    pub orders: Vec<Picture>,
    /// Standard errors of the orders.
    pub order_noise: Vec<Picture>,
    /// Means over the mask: of the picture, then of the orders.
    pub means: Vec<Mean>,
    /// Degrees of freedom behind the standard errors of the means.
    pub freedom: f64,
    /// The most that one sample adds to each pixel; none where noise counts as normal.
    pub sample: Option<Picture>,
}

/// A mean over the mask, per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mean {
    /// Radiance, W/(m² sr).
    pub value: [f64; 3],
    /// Its standard error.
    pub noise: [f64; 3],
    /// Bound on the error that the size of patches makes.
    pub systematic: [f64; 3],
}

impl Answer {
    /// The references it gives: of the picture, then of each order.
    pub(crate) fn truths(&self, mask: &Picture) -> Vec<Truth> {
        let pictures = std::iter::once((&self.picture, &self.noise)).chain(self.orders.iter().zip(&self.order_noise));
        let truth = |(picture, noise): (&Picture, &Picture)| Truth {
            noise: noise.clone(),
            mask: mask.clone(),
            ..Truth::of(picture.clone(), self.name)
        };
        pictures.map(truth).collect()
    }
}
