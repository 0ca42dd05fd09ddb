//! What progressive shooting needs of a scene: the light that one patch sends, and what is emitted at first; over an
//! assembled K, or by rays without any F.
//!
//! Not handled: the order of shots, and what is unshot; that is [`crate::solve::shooting`]'s.

use std::borrow::Cow;
use std::sync::Arc;

use rayon::prelude::*;

use crate::direct::Lights;
use crate::form_factors::cast::hemisphere_ray;
use crate::form_factors::{Sampling, Variant, cast};
use crate::light::{Light, Rgb};
use crate::operator::factored::arriving;
use crate::operator::{LinearOperator, Operator, PatchMaterials};
use crate::rays::sobol::{Sobol, hash};
use crate::rays::{Hit, Ray};
use crate::solve::neumann::{Diverges, Verdict, refuse, verdict};
use crate::surfaces::Geometry;

/// The patches as the solver sees them, one entry a patch.
#[derive(Clone, Copy, Debug)]
pub struct Surfaces<'a> {
    /// Areas, the file's units squared.
    pub areas: &'a [f64],
    /// Reflectance.
    pub rho: &'a [Rgb],
    /// Interreflection.
    pub alpha: &'a [f32],
    /// `E`, W/(m² sr).
    pub emission: &'a [Light],
}

/// A patch that shoots.
#[derive(Clone, Copy, Debug)]
pub struct Sender {
    /// Its number.
    pub patch: u32,
    /// How many shots went before: chooses the rays.
    pub shot: u64,
    /// The power it shoots as a share of the power emitted.
    pub share: f64,
}

/// A column of F, or one summand of it.
#[derive(Clone, Debug)]
pub struct Column<'a> {
    /// Which of the batch sends.
    pub sender: usize,
    /// Receiving patches, ascending.
    pub receivers: Cow<'a, [u32]>,
    /// `F_ij` of each receiver i.
    pub factors: Cow<'a, [f32]>,
    /// Rays it took.
    pub rays: u64,
}

/// What is known of convergence before the first shot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Convergence {
    /// Spectral radius proved below 1.
    Proved,
    /// Nothing: the run has to be watched.
    Unknown,
}

/// A form of shooting.
pub trait Shooter: Sync {
    /// The patches.
    fn surfaces(&self) -> Surfaces<'_>;

    /// `F E` of the emitters that do not shoot their emission themselves, punctual lights included, W/(m² sr), and
    /// how many rays it took.
    fn received(&self) -> (&[Rgb], u64);

    /// Power that punctual lights bring to the patches, W over all channels.
    fn punctual(&self) -> f64;

    /// Whether patch i's emission comes by [`Shooter::received`].
    fn emits_by_closed_form(&self, i: usize) -> bool;

    /// The columns of F of a batch of senders; several for one sender are to be added.
    fn columns(&self, senders: &[Sender]) -> Vec<Column<'_>>;

    /// What can be said of convergence beforehand.
    ///
    /// # Errors
    /// [`Diverges`] where the form knows that its series does not converge, or can bound it but not below 1.
    fn convergence(&self) -> Result<Convergence, Diverges>;
}

/// Shoots over K. F is transposed on its first use, which doubles its memory.
impl Shooter for Operator {
    fn surfaces(&self) -> Surfaces<'_> {
        Surfaces { areas: self.areas(), rho: self.reflectances(), alpha: self.alphas(), emission: self.emission() }
    }

    fn received(&self) -> (&[Rgb], u64) {
        (Operator::received(self), 0)
    }

    fn punctual(&self) -> f64 {
        Operator::punctual(self)
    }

    fn emits_by_closed_form(&self, i: usize) -> bool {
        !self.glows()[i]
    }

    fn columns(&self, senders: &[Sender]) -> Vec<Column<'_>> {
        let column = |(sender, s): (usize, &Sender)| {
            let (receivers, factors) = self.whole_transposed().row(s.patch as usize);
            Column { sender, receivers: Cow::Borrowed(receivers), factors: Cow::Borrowed(factors), rays: 0 }
        };
        senders.iter().enumerate().map(column).collect()
    }

    fn convergence(&self) -> Result<Convergence, Diverges> {
        let (verdict, spectrum) = verdict(self);
        match verdict {
            Verdict::Converges | Verdict::Ends => Ok(Convergence::Proved),
            _ => Err(refuse(self, verdict, spectrum.as_ref())),
        }
    }
}

/// How light as emitted by luminaires reaches the patches; other emitters always shoot rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Emitted {
    /// Closed form times visibility, the estimate the operator uses.
    #[default]
    ClosedForm,
    /// Rays from the luminaires, as for reflected light: power is conserved to rounding. Punctual lights go by
    /// closed form all the same.
    Rays,
}

/// How many rays, and which.
#[derive(Clone, Copy, Debug)]
pub struct RaySettings {
    /// Rays that the emitted power would take if it were shot once; a shot takes its share, rounded up to a power of 2,
    /// and at least [`RaySettings::FEWEST`].
    pub rays: u32,
    /// Receiver points a patch and luminaire, for [`Emitted::ClosedForm`].
    pub emitter_rays: u32,
    /// How luminaires send.
    pub emitted: Emitted,
    /// Chooses the scrambling of the points; the same seed gives the same bits.
    pub seed: u32,
}

impl RaySettings {
    /// Rays of a shot at least.
    pub const FEWEST: u64 = 16;
    /// Rays of a shot at most.
    pub const MOST: u64 = 1 << 24;
}

impl Default for RaySettings {
    fn default() -> Self {
        RaySettings {
            rays: 1 << 20,
            emitter_rays: Sampling::default().emitter_rays,
            emitted: Emitted::ClosedForm,
            seed: 0,
        }
    }
}

/// Rays of one summand of a column: small enough to share a large shot among threads.
const BLOCK: u64 = 4096;

/// Some of the rays of a sender.
#[derive(Clone, Copy)]
struct Block<'a> {
    /// The sender's number among those that shoot together.
    number: usize,
    sender: &'a Sender,
    /// The first ray.
    from: u64,
    /// Rays of the sender, in all its blocks.
    count: u64,
}

/// Shoots rays from the patches of a scene.
pub struct RayShooter {
    lights: Arc<Lights>,
    materials: PatchMaterials,
    areas: Vec<f64>,
    received: (Vec<Rgb>, u64),
    /// Per patch: it stands for a cell of the sky.
    sky: Vec<bool>,
    /// Power that punctual lights bring to the patches, W over all channels.
    punctual: f64,
    sobol: Sobol,
    settings: RaySettings,
}

impl RayShooter {
    /// Shoots in the mode and on the patches of these lights.
    pub fn new(lights: Arc<Lights>, settings: RaySettings) -> Self {
        let Lights { geometry, patches, luminaires, transports, .. } = &*lights;
        let Geometry { scene, rays, .. } = &**geometry;
        let materials = PatchMaterials::new(scene, patches, luminaires, transports);
        let sky: Vec<bool> = (0..patches.len()).map(|i| patches.is_sky(scene, i)).collect();
        // Tests of what stands between would cost more than the little that is received by closed form.
        let by_rays = Lights::by_rays(geometry, patches, luminaires, transports.clone());
        let sampling = Sampling { rays: 0, emitter_rays: settings.emitter_rays, seed: settings.seed };
        let receives = materials.receives();
        let mut received = match settings.emitted {
            Emitted::Rays => (vec![Rgb::ZERO; patches.len()], 0),
            Emitted::ClosedForm => by_rays.receive_emitted(&receives, &sampling, &|_| ()),
        };
        // Punctual lights shoot no rays: theirs is closed form in any case.
        let (punctual, more) = by_rays.receive_punctual(&receives, &sampling);
        received.0.iter_mut().zip(&punctual).for_each(|(sum, l)| *sum += *l);
        received.1 += more;
        if sky.contains(&true) {
            let wanted = settings.rays / patches.len() as u32;
            let sampling = Sampling { rays: wanted.clamp(64, 1 << 14), emitter_rays: 0, seed: settings.seed };
            let variant =
                Variant { tau: transports.iter().map(|t| t.tau).collect(), rows: receives, columns: sky.clone() };
            let (factors, cast) = cast(rays, patches, &[variant], &sampling, &|_| ());
            let emitted: Vec<_> = materials.emission.iter().map(|e| e.invisible.extend(0.0)).collect();
            for (sum, light) in received.0.iter_mut().zip(factors[0].rows.product(&emitted)) {
                *sum += light.truncate();
            }
            received.1 += cast;
        }
        let areas = patches.file_areas(scene);
        RayShooter {
            lights,
            materials,
            punctual: arriving(&areas, &punctual),
            areas,
            received,
            sky,
            sobol: Sobol::new(BLOCK as usize, 4),
            settings,
        }
    }

    /// Rays of a shot that carries this share of the emitted power.
    fn count(&self, share: f64) -> u64 {
        let wanted = (share * self.settings.rays as f64).ceil() as u64;
        wanted.clamp(RaySettings::FEWEST, RaySettings::MOST).next_power_of_two()
    }

    /// The part of a column that a block of rays gives.
    fn block(&self, Block { number, sender: s, from, count }: Block) -> Column<'static> {
        let to = (from + BLOCK).min(count);
        let seed = hash(s.patch, hash(s.shot as u32, hash((s.shot >> 32) as u32, self.settings.seed)));
        let mut landed = Vec::new();
        let mut hits = Vec::new();
        for k in from..to {
            let ray = hemisphere_ray(&self.lights.patches, s.patch as usize, |d| self.sobol.point(k as u32, d, seed));
            self.lights.geometry.rays.light_crossings(&ray, self.lights.opaque, &mut hits);
            self.follow(&ray, &hits, &mut landed);
        }
        let share = 1.0 / count as f64;
        let (receivers, factors) = self.merge(&mut landed, share * self.areas[s.patch as usize]);
        Column { sender: number, receivers: Cow::Owned(receivers), factors: Cow::Owned(factors), rays: to - from }
    }

    /// Lets one ray's unit of power land along its crossings.
    fn follow(&self, ray: &Ray, hits: &[Hit], landed: &mut Vec<(u32, f64)>) {
        let rays = &self.lights.geometry.rays;
        let tau = |m: usize| f64::from(self.lights.transports[m].tau);
        rays.transmit(hits, tau, |hit, through| {
            if !rays.is_sky(hit.face) {
                landed.extend(self.lights.patches.met(ray, hit).map(|j| (j, through)));
            }
        });
    }

    /// Adds up what landed on each patch, ascending, as form factors: times `scale` over the receiver's area.
    fn merge(&self, landed: &mut [(u32, f64)], scale: f64) -> (Vec<u32>, Vec<f32>) {
        landed.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let same = landed.chunk_by(|a, b| a.0 == b.0);
        same.map(|run| {
            let sum: f64 = run.iter().map(|r| r.1).sum();
            let j = run[0].0;
            (j, (sum * scale / self.areas[j as usize]) as f32)
        })
        .unzip()
    }
}

impl Shooter for RayShooter {
    fn surfaces(&self) -> Surfaces<'_> {
        Surfaces {
            areas: &self.areas,
            rho: &self.materials.rho,
            alpha: &self.materials.alpha,
            emission: &self.materials.emission,
        }
    }

    fn received(&self) -> (&[Rgb], u64) {
        (&self.received.0, self.received.1)
    }

    fn punctual(&self) -> f64 {
        self.punctual
    }

    fn emits_by_closed_form(&self, i: usize) -> bool {
        self.sky[i] || (self.settings.emitted == Emitted::ClosedForm && !self.materials.glows[i])
    }

    fn columns(&self, senders: &[Sender]) -> Vec<Column<'_>> {
        let blocks = senders.iter().enumerate().flat_map(|(number, sender)| {
            let count = self.count(sender.share);
            (0..count).step_by(BLOCK as usize).map(move |from| Block { number, sender, from, count })
        });
        let blocks: Vec<_> = blocks.collect();
        // One block gains nothing from other threads, and waking them costs more than its rays.
        if let [block] = blocks[..] {
            return vec![self.block(block)];
        }
        blocks.into_par_iter().map(|block| self.block(block)).collect()
    }

    fn convergence(&self) -> Result<Convergence, Diverges> {
        let m = &self.materials;
        let passed = m.rho.iter().zip(&m.alpha).map(|(r, a)| a * r.max_element());
        let most = passed.fold(0.0, f32::max);
        let converges = most == 0.0 || (self.lights.opaque && most < 1.0);
        Ok(if converges { Convergence::Proved } else { Convergence::Unknown })
    }
}
