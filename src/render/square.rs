//! `L = E + K L` at any point of the (alpha, tau) square, from one cast of rays.
//!
//! ```text
//! F^t  = sum over k of t^k F^(k)                        layers of one cast (form_factors::layers)
//! ```
//!
//! A material without numbers of its own takes (alpha, tau); one with its own takes alpha times its alpha and tau times
//! its tau. What patches receive as emitted depends on tau alone.
//!
//! Not handled: bounds over the square (the guest `study`).

use std::sync::Arc;

use crate::direct::{Lights, Received, TOLERABLE};
use crate::form_factors::{FormFactors, Layers, Rows, Sampling, cast_layers};
use crate::light::Transport;
use crate::operator::{Operator, PatchMaterials};
use crate::render::assembly::{Assembled, Discretization, Watch, materials, variant};

/// All crossings of the rays of a scene's patches.
pub struct Square<'a> {
    patches: Discretization,
    layers: Layers,
    sampling: Sampling,
    watch: &'a dyn Watch,
}

/// The points of one tau.
pub struct SquareColumn<'a> {
    square: &'a Square<'a>,
    tau: f32,
    /// What lights the patches, and what lies between.
    pub lights: Arc<Lights>,
    received: Received,
    rows: Rows,
}

/// (alpha, tau) of every material at a point of the square.
fn transports(patches: &Discretization, point: Transport) -> Vec<Transport> {
    let own = patches.transports(Transport { alpha: 1.0, tau: 1.0 });
    own.iter().map(|t| Transport { alpha: point.alpha * t.alpha, tau: point.tau * t.tau }).collect()
}

impl<'a> Square<'a> {
    /// Casts the rays, materials at alpha = tau = 1 or their own.
    pub fn new(patches: &Discretization, sampling: &Sampling, watch: &'a dyn Watch) -> Square<'a> {
        let corner = transports(patches, Transport { alpha: 1.0, tau: 1.0 });
        let Discretization { geometry, luminaires, patches: own, .. } = patches;
        let m = PatchMaterials::new(&geometry.scene, own, luminaires, &corner);
        watch.begin("form factors", own.len() as u64);
        let tick = |done| watch.tick(done);
        let (layers, _) = cast_layers(&geometry.rays, own, &variant(&corner, &m), sampling, &tick);
        Square { patches: patches.clone(), layers, sampling: *sampling, watch }
    }

    /// The points of one tau.
    pub fn column(&self, tau: f32) -> SquareColumn<'_> {
        let lights = self.patches.lights(transports(&self.patches, Transport { alpha: 1.0, tau }), TOLERABLE);
        let receives = materials(&lights).receives();
        self.watch.begin("light as emitted", lights.patches.len() as u64);
        let received = lights.receive(&receives, &self.sampling, &|done| self.watch.tick(done));
        SquareColumn { square: self, tau, lights, received, rows: self.layers.form_factors(tau) }
    }
}

impl SquareColumn<'_> {
    /// The equation at an alpha.
    pub fn at(&self, alpha: f32) -> Assembled {
        let Discretization { geometry, luminaires, patches, .. } = &self.square.patches;
        let transport = Transport { alpha, tau: self.tau };
        let own = transports(&self.square.patches, transport);
        let m = PatchMaterials::new(&geometry.scene, patches, luminaires, &own);
        let f = FormFactors { rows: self.rows.clone(), row_sums: vec![None; patches.len()] };
        let operator = Operator::new(f, m, patches.file_areas(&geometry.scene), self.received.luminaires.clone())
            .with_punctual(&self.received.punctual);
        let sampling = self.square.sampling;
        Assembled { transport, lights: Arc::clone(&self.lights), operator, row_sums: None, sampling }
    }
}
