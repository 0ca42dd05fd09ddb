//! K of a scene, stored factored: one sparse F, and alpha and rho of each patch.
//!
//! Light as emitted by luminaires goes through the closed form instead ([`LinearOperator::first_bounce`]); everything
//! after the first bounce goes through F. Not handled: how F and the closed forms are found.

use std::sync::OnceLock;

use glam::Vec4;
use nalgebra::{DMatrix, Matrix2};
use sprs::{CsMat, TriMat};

use crate::direct::Luminaires;
use crate::form_factors::{Columns, FormFactors, Rows};
use crate::light::{Light, Rgb, Transport, reflectance};
use crate::operator::linear::{LinearOperator, padded, reflected};
use crate::patches::Patches;
use crate::scene::Scene;

/// K of one scene and one choice of (alpha, tau), with the E it acts on first.
#[derive(Debug)]
pub struct Operator {
    f: Rows,
    transposed: OnceLock<Rows>,
    /// F transposed with all its rows, where `f` is a part.
    whole_transposed: OnceLock<Rows>,
    rho: Vec<Rgb>,
    alpha: Vec<f32>,
    areas: Vec<f64>,
    emission: Vec<Light>,
    /// Per patch: its emission goes through F, not through the closed form.
    glows: Vec<bool>,
    /// `F E` of the luminaires, by closed form, and what punctual lights send.
    received: Vec<Rgb>,
    /// Power that punctual lights bring to the patches, W over all channels.
    punctual: f64,
    /// The emitters' parts of `E`, and of `received`; empty where they are not kept apart.
    emitters: Vec<EmitterLight>,
}

/// The light of one emitter on its way to the patches.
#[derive(Clone, Debug)]
pub struct EmitterLight {
    /// Its part of `E`.
    pub emission: Vec<Light>,
    /// Its part of [`Operator::received`].
    pub received: Vec<Rgb>,
}

/// What each patch is made of, under one choice of (alpha, tau).
#[derive(Clone, Debug)]
pub struct PatchMaterials {
    /// Reflectance.
    pub rho: Vec<Rgb>,
    /// Interreflection.
    pub alpha: Vec<f32>,
    /// `E`.
    pub emission: Vec<Light>,
    /// Emits without being a luminaire: its emission goes through F.
    pub glows: Vec<bool>,
}

impl PatchMaterials {
    /// Looks up every patch's material, or the means of its textures.
    pub fn new(scene: &Scene, patches: &Patches, luminaires: &Luminaires, transports: &[Transport]) -> PatchMaterials {
        let carried = |i: usize| luminaires.carries[patches.materials()[i] as usize];
        let all = 0..patches.len();
        let emission: Vec<Light> = all.clone().map(|i| patches.emitted(scene, i)).collect();
        PatchMaterials {
            rho: all.clone().map(|i| patches.reflectance(scene, i)).collect(),
            alpha: patches.materials().iter().map(|&m| transports[m as usize].alpha).collect(),
            glows: emission.iter().zip(all).map(|(e, i)| e.invisible != Rgb::ZERO && !carried(i)).collect(),
            emission,
        }
    }

    /// Patches that reflect: the rows F needs.
    pub fn receives(&self) -> Vec<bool> {
        self.rho.iter().map(|r| r.max_element() > 0.0).collect()
    }

    /// `alpha_i rho_i`, the largest channel.
    pub fn passed_on(&self) -> Vec<f32> {
        let pairs = self.alpha.iter().zip(&self.rho);
        pairs.map(|(alpha, rho)| alpha * rho.max_element()).collect()
    }

    /// Patches that send through F: what they reflect travels on, or they emit without being a luminaire.
    pub fn sends(&self) -> Vec<bool> {
        let passes = |i: usize| self.alpha[i] > 0.0 && self.rho[i].max_element() > 0.0;
        (0..self.rho.len()).map(|i| passes(i) || self.glows[i]).collect()
    }
}

impl Operator {
    /// Puts K together. `areas` are in the file's units squared; `received` is `F E` of the luminaires.
    ///
    /// # Panics
    /// If the parts do not have one entry a patch.
    pub fn new(f: FormFactors, materials: PatchMaterials, areas: Vec<f64>, received: Vec<Rgb>) -> Operator {
        let n = f.rows.len();
        assert!(materials.rho.len() == n && areas.len() == n && received.len() == n);
        Operator {
            f: f.rows,
            transposed: OnceLock::new(),
            whole_transposed: OnceLock::new(),
            rho: materials.rho,
            alpha: materials.alpha,
            areas,
            emission: materials.emission,
            glows: materials.glows,
            received,
            punctual: 0.0,
            emitters: Vec::new(),
        }
    }

    /// Keeps the light of emitters apart, which together are `E` and what is received.
    pub fn with_emitters(self, emitters: Vec<EmitterLight>) -> Operator {
        Operator { emitters, ..self }
    }

    /// The light of each emitter; empty where they are not kept apart.
    pub fn emitters(&self) -> &[EmitterLight] {
        &self.emitters
    }

    /// `K E` of a part of E whose light by luminaires is `received`.
    pub fn first_bounce_of(&self, light: &EmitterLight) -> Vec<Light> {
        self.bounce_once(&light.emission, &light.received)
    }

    /// Adds what patches receive from punctual lights, irradiance over pi in W/(m² sr); none of them may be given.
    pub fn with_punctual(mut self, light: &[Rgb]) -> Operator {
        for (sum, l) in self.received.iter_mut().zip(light) {
            *sum += *l;
        }
        self.punctual += arriving(&self.areas, light);
        self
    }

    /// Power that punctual lights bring to the patches, W over all channels.
    pub fn punctual(&self) -> f64 {
        self.punctual
    }

    /// Number of patches.
    pub fn len(&self) -> usize {
        self.rho.len()
    }

    /// Whether there are no patches.
    pub fn is_empty(&self) -> bool {
        self.rho.is_empty()
    }

    /// F as stored; where several processes share a solve, the rows that this one keeps ([`Rows::whole`]).
    pub fn form_factors(&self) -> &Rows {
        &self.f
    }

    /// `F E` of the luminaires by closed form, and what punctual lights send, W/(m² sr); 0 on patches that reflect
    /// nothing.
    pub fn received(&self) -> &[Rgb] {
        &self.received
    }

    /// Patches whose emission goes through F; that of all others comes by [`Operator::received`].
    pub fn glows(&self) -> &[bool] {
        &self.glows
    }

    /// F transposed, its row j what patch j sends; made on first use.
    pub fn transposed(&self) -> &Rows {
        self.transposed.get_or_init(|| self.f.transposed())
    }

    /// F transposed with all its rows, wherever those of F are kept; all processes are to call it together.
    pub fn whole_transposed(&self) -> &Rows {
        let transposed = self.transposed();
        let is_whole = transposed.own().len() == transposed.len();
        if is_whole { transposed } else { self.whole_transposed.get_or_init(|| transposed.clone().whole()) }
    }
}

/// Power that arrives on patches, W over all channels: `pi sum A_i l_i` for irradiances over pi.
pub(crate) fn arriving(areas: &[f64], light: &[Rgb]) -> f64 {
    let sum: f64 = areas.iter().zip(light).map(|(a, l)| a * l.as_dvec3().element_sum()).sum();
    std::f64::consts::PI * sum
}

impl LinearOperator for Operator {
    fn areas(&self) -> &[f64] {
        &self.areas
    }

    fn reflectances(&self) -> &[Rgb] {
        &self.rho
    }

    fn alphas(&self) -> &[f32] {
        &self.alpha
    }

    fn emission(&self) -> &[Light] {
        &self.emission
    }

    fn incident(&self, x: &[Vec4]) -> Vec<Vec4> {
        self.f.product(x)
    }

    fn sent(&self, y: &[Vec4]) -> Vec<Vec4> {
        self.transposed().product(y)
    }

    /// Luminaires go by closed form, other emitters by the rows of F.
    fn first_bounce(&self) -> Vec<Light> {
        self.bounce_once(&self.emission, &self.received)
    }

    fn incident_columns(&self, x: &Columns) -> Columns {
        self.f.product_of_columns(x)
    }
}

impl Operator {
    /// What patches reflect of the light `received` and, by the rows of F, of what glows.
    fn bounce_once(&self, emission: &[Light], received: &[Rgb]) -> Vec<Light> {
        let glows = emission.iter().zip(&self.glows);
        let glow: Vec<Light> = glows.map(|(e, &glows)| if glows { *e } else { Light::default() }).collect();
        let is_dark = glow.iter().all(|l| *l == Light::default());
        let from_glow = if is_dark { vec![Vec4::ZERO; self.len()] } else { self.f.product(&padded(&glow)) };
        let total = |i: usize| from_glow[i].truncate() + received[i];
        (0..self.len()).map(|i| reflected(self.rho[i], self.alpha[i], total(i))).collect()
    }

    /// K of channel c (0 red, 1 green, 2 blue) with blocks `K_ij = F_ij rho_i [[alpha_i, 0], [1, 0]]`.
    pub fn blocks(&self, c: usize) -> CsMat<Matrix2<f32>> {
        let n = self.len();
        let mut k = TriMat::new((n, n));
        let f = self.f.clone().whole();
        for i in 0..n {
            let matrix = reflectance(self.rho[i][c], self.alpha[i]);
            let (columns, values) = f.row(i);
            for (&j, &f) in columns.iter().zip(values) {
                k.add_triplet(i, j as usize, f * matrix);
            }
        }
        k.to_csr()
    }

    /// K of channel c as a dense 2n×2n matrix, components of a patch side by side (invisible, visible).
    pub fn dense(&self, c: usize) -> DMatrix<f64> {
        let n = self.len();
        let mut k = DMatrix::zeros(2 * n, 2 * n);
        for (block, (i, j)) in self.blocks(c).iter() {
            let mut place = k.fixed_view_mut::<2, 2>(2 * i, 2 * j);
            place.copy_from(&block.cast::<f64>());
        }
        k
    }
}
