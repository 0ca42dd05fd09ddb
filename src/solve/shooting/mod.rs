//! Progressive shooting: L found by letting the patch with the most unshot power shoot, again and again.
//!
//! ```text
//! patch j shoots its unshot L_j:   visible_i   +=         rho_i F_ij L_j     collected, never shot again
//!                                  invisible_i += alpha_i rho_i F_ij L_j     unshot: waits for its own shot
//! ```
//!
//! A batch of the brightest patches shoots at a time, each all its generations at once, every one into the next. So the
//! bounce number stays explicit: generation n tends to `KⁿE`. Two forms stand behind [`Shooter`]:
//! [`Operator`](crate::operator::Operator) over its columns, and [`RayShooter`](shooters::RayShooter) with rays alone.
//! tau acts inside F. The result does not depend on the number of threads.
//!
//! Several E shoot together: a patch shoots what is unshot of each of them by one column of F, and the brightest is
//! told by the sum of their unshot power. The light of each is what the same shots give it alone.
//!
//! Not handled, both measured at about 500 patches over K. An ambient term for what is unshot lowers the error of the
//! light by a third, which saves a quarter of the shots at 10 % unshot and an eighth at 1 %; but it belongs to no
//! generation. Shooting 1.2 times the unshot light, the excess taken back later, saves a third of the shots to 1 % or
//! more; but rays are spent by power and not by shots, and unshot light of either sign would make the stop harder to
//! read.
//!
//! Source: M. Cohen, S. Chen, J. Wallace, D. Greenberg, *A progressive refinement approach to fast radiosity image
//! generation*, SIGGRAPH 1988.

pub(crate) mod ledger;
pub(crate) mod shooters;

pub(crate) use shooters::{Column, Sender, Shooter};

use std::borrow::Cow;

use glam::DVec3;

use crate::light::{Light, Rgb};
use crate::operator::{Bounds, EmitterLight};
use crate::solve::neumann::{Diverges, Verdict};
use crate::solve::shooting::ledger::{Ledger, Shot};
use crate::solve::shooting::shooters::{Convergence, Surfaces};

/// Batches in which all patches would shoot once.
const BATCHES: usize = 64;

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct ShootingSettings {
    /// Requested unshot power as a share of the power emitted.
    pub unshot: f64,
    /// Generations kept apart, at least 2; the last also takes all later ones.
    pub generations: usize,
    /// Shots at most, per patch on average; a series not decided by then is refused as undecided.
    pub shots_per_patch: u64,
}

impl Default for ShootingSettings {
    fn default() -> Self {
        ShootingSettings { unshot: 1e-3, generations: 16, shots_per_patch: 1000 }
    }
}

/// How far shooting has come.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Progress {
    /// Patches that shot, each shot counted.
    pub shots: u64,
    /// Batches.
    pub batches: u64,
    /// Rays cast.
    pub rays: u64,
    /// Unshot power, W over all channels.
    pub unshot: f64,
    /// Unshot power as a share of the power emitted.
    pub share: f64,
}

/// A running solution.
pub struct Shooting<'a> {
    shooter: &'a dyn Shooter,
    settings: ShootingSettings,
    /// The E that are kept apart; none where there is but that of the shooter.
    sources: Option<&'a [EmitterLight]>,
    ledger: Ledger,
    /// `pi sum A E_invisible`, and what punctual lights bring to the patches, W over all channels.
    emitted: f64,
    progress: Progress,
    growth: Growth,
}

impl<'a> Shooting<'a> {
    /// Everything emitted, nothing shot.
    ///
    /// # Errors
    /// [`Diverges`] where the form proves beforehand that the series does not converge.
    pub fn new(shooter: &'a dyn Shooter, settings: ShootingSettings) -> Result<Self, Diverges> {
        Shooting::start(shooter, None, &[shooter.surfaces().emission], settings)
    }

    /// Starts from several E that are kept apart, in place of the shooter's own: [`Operator::emitters`] or any others.
    /// Patches that do not shoot their emission themselves ([`Shooter::emits_by_closed_form`]) send it by what is
    /// `received`. `settings.unshot` is a share of the power of all sources.
    ///
    /// [`Operator::emitters`]: crate::operator::Operator::emitters
    ///
    /// # Errors
    /// As [`Shooting::new`].
    ///
    /// # Panics
    /// If a source does not have one light a patch.
    pub fn of_sources(
        shooter: &'a dyn Shooter,
        sources: &'a [EmitterLight],
        settings: ShootingSettings,
    ) -> Result<Self, Diverges> {
        let emissions: Vec<&[Light]> = sources.iter().map(|source| &*source.emission).collect();
        Shooting::start(shooter, Some(sources), &emissions, settings)
    }

    fn start(
        shooter: &'a dyn Shooter,
        sources: Option<&'a [EmitterLight]>,
        emissions: &[&[Light]],
        settings: ShootingSettings,
    ) -> Result<Self, Diverges> {
        let convergence = shooter.convergence()?;
        let ledger = Ledger::new(&shooter.surfaces(), emissions, settings.generations.max(2));
        let emitted: f64 = ledger.power().iter().sum::<f64>() + shooter.punctual();
        let n = ledger.power().len();
        Ok(Shooting {
            shooter,
            settings,
            sources,
            emitted,
            progress: Progress { unshot: emitted, share: f64::from(u8::from(emitted > 0.0)), ..Progress::default() },
            growth: Growth::new(n, convergence, settings.shots_per_patch),
            ledger,
        })
    }

    /// Shoots one batch; `None` once no more than the requested share is unshot.
    ///
    /// # Errors
    /// [`Diverges`] when the light shot so far shows that the series diverges, or when it stays undecided.
    pub fn step(&mut self) -> Result<Option<Progress>, Diverges> {
        if self.progress.share <= self.settings.unshot {
            return Ok(None);
        }
        let emitters = self.closed_form_emitters();
        if emitters.is_empty() && !(self.progress.batches == 0 && self.is_received()) {
            self.shoot_batch();
        } else {
            self.receive_emitted(&emitters);
        }
        self.progress.batches += 1;
        self.progress.unshot = self.ledger.power().iter().sum();
        self.progress.share = self.progress.unshot / self.emitted;
        let surfaces = self.shooter.surfaces();
        self.growth.check(&surfaces, &self.ledger, self.progress.shots)?;
        Ok(Some(self.progress))
    }

    /// Steps to the end; `each` sees the running solution after each batch.
    ///
    /// # Errors
    /// As [`Shooting::step`].
    pub fn run(&mut self, mut each: impl FnMut(&Self)) -> Result<Progress, Diverges> {
        while self.step()?.is_some() {
            each(self);
        }
        Ok(self.progress)
    }

    /// How far it has come.
    pub fn progress(&self) -> Progress {
        self.progress
    }

    /// `L` so far: emitted and received, shot or not; of several sources that of the first.
    pub fn light(&self) -> Vec<Light> {
        self.light_of(0)
    }

    /// `L` of a source so far.
    ///
    /// # Panics
    /// If there is no such source.
    pub fn light_of(&self, source: usize) -> Vec<Light> {
        let light = |(i, e): (usize, &Light)| {
            let r = self.reflect(i, self.ledger.all_incident(i, source).sum());
            Light { invisible: e.invisible + r.invisible, visible: e.visible + r.visible }
        };
        self.emission(source).iter().enumerate().map(light).collect()
    }

    /// What every patch received in generation n so far, both halves; E for n = 0, and 0 beyond the last. Of several
    /// sources that of the first.
    ///
    /// The last generation that the settings keep apart also holds all later ones.
    pub fn generation(&self, n: usize) -> Vec<Light> {
        self.generation_of(0, n)
    }

    /// What every patch received of one source in generation n so far, both halves; its E for n = 0.
    ///
    /// # Panics
    /// If there is no such source.
    pub fn generation_of(&self, source: usize, n: usize) -> Vec<Light> {
        let emission = self.emission(source);
        match n {
            0 => emission.to_vec(),
            _ => (0..emission.len()).map(|i| self.reflect(i, self.ledger.incident(i, source, n))).collect(),
        }
    }

    /// `E` of a source; of the shooter where no sources are kept apart.
    fn emission(&self, source: usize) -> &[Light] {
        self.sources.map_or(self.shooter.surfaces().emission, |sources| &sources[source].emission)
    }

    /// The number of generations that light reached, those of E and KE at least; later ones are 0.
    pub fn generations(&self) -> usize {
        self.ledger.generations()
    }

    /// Light reflected where this much is incident.
    fn reflect(&self, i: usize, incident: DVec3) -> Light {
        let surfaces = self.shooter.surfaces();
        let visible = surfaces.rho[i].as_dvec3() * incident;
        Light { invisible: (surfaces.alpha[i] as f64 * visible).as_vec3(), visible: visible.as_vec3() }
    }

    /// Emitters that have yet to send by closed form.
    fn closed_form_emitters(&self) -> Vec<usize> {
        if self.progress.batches > 0 {
            return Vec::new();
        }
        let power = self.ledger.power();
        (0..power.len()).filter(|&i| power[i] > 0.0 && self.shooter.emits_by_closed_form(i)).collect()
    }

    /// Whether light arrives that no patch sends.
    fn is_received(&self) -> bool {
        let Some(sources) = self.sources else { return self.shooter.punctual() > 0.0 };
        sources.iter().flat_map(|source| &source.received).any(|r| *r != Rgb::ZERO)
    }

    /// Lets the emitters among `patches` and punctual lights send all they emit, once: the first bounce by closed
    /// form.
    fn receive_emitted(&mut self, patches: &[usize]) {
        patches.iter().for_each(|&i| drop(self.ledger.take(i)));
        let (received, rays) = self.shooter.received();
        let received: Vec<&[Rgb]> = match self.sources {
            Some(sources) => sources.iter().map(|source| &*source.received).collect(),
            None => vec![received],
        };
        // The light received is a column for each channel of a sender of unit radiance.
        let all: Vec<u32> = (0..self.ledger.power().len() as u32).collect();
        let (mut shots, mut columns) = (Vec::new(), Vec::new());
        for (source, received) in received.into_iter().enumerate() {
            for (c, axis) in DVec3::AXES.into_iter().enumerate() {
                let factors = received.iter().map(|r| r[c]).collect();
                columns.push(Column { sender: shots.len(), receivers: Cow::Borrowed(&all), factors, rays: 0 });
                shots.push(vec![(source, axis)]);
            }
        }
        self.progress.rays += rays;
        self.progress.shots += patches.len() as u64;
        self.ledger.deposit(&self.shooter.surfaces(), &columns, &shots);
    }

    /// Lets the patches with the most unshot power shoot.
    fn shoot_batch(&mut self) {
        let senders = self.brightest();
        let shots: Vec<Shot> = senders.iter().map(|s| self.ledger.take(s.patch as usize)).collect();
        for (s, shot) in senders.iter().zip(&shots) {
            let reflected = shot.iter().filter(|(slot, _)| self.ledger.generation_of(*slot) >= 1).map(|(_, l)| *l);
            self.growth.shot[s.patch as usize] += reflected.sum::<DVec3>();
        }
        let columns = self.shooter.columns(&senders);
        self.progress.rays += columns.iter().map(|column| column.rays).sum::<u64>();
        self.progress.shots += senders.len() as u64;
        self.ledger.deposit(&self.shooter.surfaces(), &columns, &shots);
    }

    /// The next batch, brightest first; of equals the one with the smaller number.
    fn brightest(&self) -> Vec<Sender> {
        let power = self.ledger.power();
        let size = (power.len() / BATCHES).max(1);
        let order = |a: &u32, b: &u32| {
            let [p, q] = [a, b].map(|&i| power[i as usize]);
            q.total_cmp(&p).then(a.cmp(b))
        };
        let mut waiting: Vec<u32> = (0..power.len() as u32).filter(|&i| power[i as usize] > 0.0).collect();
        if waiting.len() > size {
            waiting.select_nth_unstable_by(size - 1, order);
            waiting.truncate(size);
        }
        waiting.sort_unstable_by(order);
        let sender = |(k, &patch): (usize, &u32)| Sender {
            patch,
            shot: self.progress.shots + k as u64,
            share: power[patch as usize] / self.emitted,
        };
        waiting.iter().enumerate().map(sender).collect()
    }
}

/// Watches a run whose convergence is not known beforehand.
struct Growth {
    watched: bool,
    /// Invisible light each patch has shot after its first reflection; light as emitted does not count.
    shot: Vec<DVec3>,
    /// Shots after which the growth is checked next.
    next: u64,
    /// Shots after which to give up.
    most: u64,
}

impl Growth {
    /// Nothing shot yet.
    fn new(patches: usize, convergence: Convergence, shots_per_patch: u64) -> Growth {
        Growth {
            watched: convergence == Convergence::Unknown,
            shot: vec![DVec3::ZERO; patches],
            next: patches as u64,
            most: shots_per_patch.saturating_mul(patches as u64),
        }
    }

    /// Checks four times a sweep over all patches whether the light shot so far shows growth.
    fn check(&mut self, surfaces: &Surfaces, ledger: &Ledger, shots: u64) -> Result<(), Diverges> {
        if !self.watched || shots < self.next {
            return Ok(());
        }
        self.next = shots + (self.shot.len() as u64).div_ceil(4);
        let radius = bounds(surfaces, ledger, &self.shot);
        let verdict = if radius.lower >= 1.0 {
            Verdict::Diverges
        } else if shots >= self.most {
            Verdict::Undecided
        } else {
            return Ok(());
        };
        Err(Diverges::new(surfaces.rho, surfaces.alpha, verdict, radius))
    }
}

/// Bounds on the spectral radius, worst channel, from the light `shot` by every patch after its first reflection.
fn bounds(surfaces: &Surfaces, ledger: &Ledger, shot: &[DVec3]) -> Bounds {
    let mut products = DVec3::ZERO;
    let mut squares = DVec3::ZERO;
    let mut upper = 0.0f64;
    for (i, &s) in shot.iter().enumerate() {
        let passed = (surfaces.alpha[i] * surfaces.rho[i]).as_dvec3();
        let incident = ledger.reflected(i);
        for c in (0..3).filter(|&c| passed[c] > 0.0) {
            let r = passed[c] * incident[c];
            products[c] += surfaces.areas[i] * s[c] * r / passed[c];
            squares[c] += surfaces.areas[i] * s[c] * s[c] / passed[c];
            if r > 0.0 {
                upper = upper.max(r / s[c]);
            }
        }
    }
    let quotient = |c: usize| if squares[c] > 0.0 { products[c] / squares[c] } else { 0.0 };
    let lower = (0..3).map(quotient).fold(0.0, f64::max);
    Bounds { lower, upper: upper.max(lower) }
}
