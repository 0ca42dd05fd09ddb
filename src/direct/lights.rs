//! The luminaires and punctual lights of a scene under one choice of (alpha, tau), and the light cuts of its patches.
//!
//! Not handled: emitters that are no luminaires, whose light hemisphere rays sample.

use std::sync::Arc;

use halflight_team::Loop;

use crate::direct::emitters::luminaire_texture::TOLERABLE;
use crate::direct::emitters::luminaires::Luminaires;
use crate::direct::emitters::occlusion::Occlusion;
use crate::direct::emitters::shafts::casters;
use crate::direct::many::light_cut::{CutInputs, CutMemory, LightCut, MOST_DRAWN, reaching};
use crate::direct::many::light_tree::LightTree;
use crate::direct::many::place::Place;
use crate::form_factors::shadow::Caster;
use crate::light::{Rgb, Transport, nothing_passes};
use crate::patches::Patches;
use crate::scene::{Camera, Emitters};
use crate::surfaces::{Geometry, SurfacePoint};

/// Faces beyond which patches do not test what stands between, and beyond which single points do not, which draw more
/// rays.
const MOST_FACES: usize = 4_000;
const MOST_FACES_OF_POINTS: usize = 20_000;

/// The luminaires and punctual lights of a scene in one mode, and how they light its patches; clones share most of it.
#[derive(Clone)]
pub struct Lights {
    /// The scene, its rays and its surfaces.
    pub geometry: Arc<Geometry>,
    /// The patches that receive.
    pub patches: Arc<Patches>,
    /// Emitters by closed form.
    pub luminaires: Arc<Luminaires>,
    /// (alpha, tau) of every material.
    pub transports: Vec<Transport>,
    /// No surface lets light through.
    pub opaque: bool,
    /// Relative error of light that a node of many luminaires, or of a texture, may have.
    pub exactness: f64,
    /// Occlusion between any two points.
    pub(crate) occlusion: Occlusion,
    /// Occlusion of punctual lights.
    pub(crate) punctual: Occlusion,
    /// The faces that may occlude and do; none where nothing is to be tested against them.
    pub(crate) casters: Arc<[Caster]>,
    /// The luminaires of each emitter.
    pub(crate) trees: Arc<[LightTree]>,
    /// Patch by patch, the cut through each tree; empty ones where a patch does not receive.
    cuts: Arc<[LightCut]>,
    /// Some cut has nodes or polynomials that stand for luminaires.
    approximates: bool,
}

/// The cuts through the light trees that a receiver reads: those of its patch, or its own.
#[derive(Clone, Copy, Debug)]
pub struct Cuts<'a>(pub(crate) &'a [LightCut]);

/// The cuts of a receiver that lies on no patch.
#[derive(Debug)]
pub struct OwnCuts(Vec<LightCut>);

impl OwnCuts {
    /// To be read.
    pub fn cuts(&self) -> Cuts<'_> {
        Cuts(&self.0)
    }
}

/// Whether shadows are found where they can be cut out of the luminaires, or by visibility rays alone.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shadows {
    CutOut,
    ByRays,
}

impl Lights {
    /// Determines what of the luminaires every patch that reflects sees; `exactness` is the relative error that a node
    /// of many luminaires, or of a texture, may have.
    pub fn new(
        geometry: &Arc<Geometry>,
        patches: &Arc<Patches>,
        luminaires: &Arc<Luminaires>,
        transports: Vec<Transport>,
        exactness: f64,
    ) -> Lights {
        let lights = Lights::without_cuts(geometry, patches, luminaires, transports, exactness);
        lights.with_cuts(Shadows::CutOut)
    }

    /// Lights that know of no occluder: points are drawn wherever something can occlude.
    pub fn by_rays(
        geometry: &Arc<Geometry>,
        patches: &Arc<Patches>,
        luminaires: &Arc<Luminaires>,
        transports: Vec<Transport>,
    ) -> Lights {
        Lights::without_cuts(geometry, patches, luminaires, transports, TOLERABLE).with_cuts(Shadows::ByRays)
    }

    /// The same behind another model of occlusion.
    pub fn occluded_by(self, occlusion: Occlusion) -> Lights {
        Lights { punctual: occlusion.clone(), occlusion, ..self }.with_cuts(Shadows::ByRays)
    }

    /// The same behind another camera: patches are lit as they were.
    pub fn seen_by(&self, camera: Camera) -> Lights {
        Lights { geometry: self.geometry.seen_by(camera), ..self.clone() }
    }

    fn without_cuts(
        geometry: &Arc<Geometry>,
        patches: &Arc<Patches>,
        luminaires: &Arc<Luminaires>,
        transports: Vec<Transport>,
        exactness: f64,
    ) -> Lights {
        let Geometry { scene, rays, .. } = &**geometry;
        let occlusion = Occlusion::new(rays, &transports);
        let tau: Vec<f32> = transports.iter().map(|t| t.tau).collect();
        Lights {
            punctual: Occlusion::of_punctual(scene, rays, &transports, &luminaires.punctual),
            casters: match occlusion {
                Occlusion::Nothing => Arc::default(),
                _ => casters(scene, rays, luminaires, &tau).into(),
            },
            occlusion,
            geometry: Arc::clone(geometry),
            patches: Arc::clone(patches),
            luminaires: Arc::clone(luminaires),
            opaque: nothing_passes(transports.iter().map(|t| t.tau)),
            trees: LightTree::of_emitters(luminaires, exactness).into(),
            transports,
            exactness,
            cuts: Arc::default(),
            approximates: false,
        }
    }

    /// What cuts are made from.
    fn inputs(&self) -> CutInputs<'_> {
        let Lights { geometry, luminaires, occlusion, casters, exactness, .. } = self;
        let casters = if *occlusion == Occlusion::Nothing { &[] } else { &casters[..] };
        CutInputs { rays: &geometry.rays, luminaires, occlusion, casters, exactness: *exactness }
    }

    /// These lights with the cuts of all patches that reflect.
    fn with_cuts(self, shadows: Shadows) -> Lights {
        let inputs = self.inputs();
        let materials = &self.geometry.scene.materials;
        let receives = |i: usize| materials[self.patches.materials()[i] as usize].rho != Rgb::ZERO;
        let among: Vec<Vec<u32>> = self.trees.iter().map(|tree| reaching(&inputs, tree)).collect();
        let count = self.patches.len();
        let one = |memory: &mut CutMemory, i: usize| -> Vec<LightCut> {
            if !receives(i) {
                return self.trees.iter().map(|_| LightCut::default()).collect();
            }
            let place = Place::of_patch(&self.patches, i);
            let each = self.trees.iter().zip(&among).map(|(tree, among)| {
                let tested = shadows == Shadows::CutOut && among.len() <= MOST_FACES;
                LightCut::new(&inputs, tree, &place, tested.then_some(&among[..]), memory)
            });
            each.collect()
        };
        let all = Loop::weighed(count, |i| f64::from(u8::from(receives(i)))).map_init(CutMemory::default, one);
        let cuts: Arc<[LightCut]> = all.into_iter().flatten().collect();
        let mut of_trees = cuts.iter().zip(self.trees.iter().cycle());
        let approximates = of_trees.any(|(cut, tree)| cut.approximates(tree));
        Lights { cuts, approximates, ..self }
    }

    /// The cuts of a patch.
    pub fn cuts(&self, patch: u32) -> Cuts<'_> {
        let count = self.trees.len();
        Cuts(&self.cuts[patch as usize * count..(patch as usize + 1) * count])
    }

    /// The cuts of a point that lies on no patch, or is asked often.
    pub fn cuts_at(&self, point: &SurfacePoint) -> OwnCuts {
        let (inputs, place, mut memory) = (self.inputs(), Place::of_point(point), CutMemory::default());
        let each = self.trees.iter().map(|tree| {
            let among = reaching(&inputs, tree);
            let tested = (among.len() <= MOST_FACES_OF_POINTS).then_some(&among[..]);
            LightCut::new(&inputs, tree, &place, tested, &mut memory)
        });
        OwnCuts(each.collect())
    }

    /// The emitters whose light is kept apart.
    pub fn emitters(&self) -> &Emitters {
        &self.luminaires.emitters
    }

    /// Points of the unit square that one receiver uses at most for `rays` visibility rays of each draw.
    pub fn points(&self, rays: u32) -> u32 {
        rays * MOST_DRAWN
    }

    /// Relative error that nodes of luminaires and polynomials may have; 0 where there are none.
    pub fn stand_ins(&self) -> f64 {
        if self.approximates { self.exactness } else { 0.0 }
    }
}
