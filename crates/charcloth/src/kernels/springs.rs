//! One explicit substep of all springs: forces, velocities, positions.
//!
//! Model: springs with a linear law, a tension of their own and damping along them (Eq. 6.1, 6.4), symplectic Euler
//! (Eq. 6.6). Source: [Provot1995]. Valid when: the substep is below the bound of Eq. 6.7. Cost: about 25 flops and 16
//! bytes a link, 240 bytes a node.
//!
//! Positions and velocities are f64, by slices, and only the lanes of a slice touch their own. What neighbours see is one
//! record of 32 bytes ([`Seen`]): the position as a whole number of grid steps, modulo 2^32, and the velocity as f32. The
//! difference of two such numbers is exact wherever the sheet is, and the step of the grid ([`SpringBuffers::grid`]) is a
//! power of two so far below the longest spring that the rounding is finer than that of an f32 of the spring's length.
//! Gathering is what this loop spends its time on: two f64 records a neighbour cost twice as many shuffles.
//!
//! The force of a link is written as K l + c, with c = tension - K L: the loop needs no rest length, and a spring
//! without stiffness is no special case. Lengths are counted in grid steps; as these are powers of two, that changes
//! exponents and no digit. A link also carries the square of the length at which somebody must look at its spring (it
//! breaks, is stretched past the limit, or outgrows the grid); the loop only marks the slice.

use super::{LANES, Links, SLICES_A_TASK, VectorUnit, for_each_task};
use rayon::iter::IndexedParallelIterator;
use rayon::slice::ParallelSliceMut;

/// Gathers sixteen records and turns them into six columns: x, y, z in grid steps and the velocity. Plain loads and
/// shuffles, for gather instructions are slower. A macro, because a function with target features may not be forced
/// inline.
#[cfg(target_arch = "x86_64")]
macro_rules! columns16 {
    ($seen:expr, $index:expr) => {{
        // SAFETY: `Links::build` only names nodes there are, `substep` has seen that there is a record for each, and a
        // record is eight 4-byte numbers on a 32-byte boundary. Indices count quarters of records.
        macro_rules! load {
            ($lane:expr) => {
                unsafe { _mm256_load_ps($seen.as_ptr().cast::<u64>().add($index[$lane] as usize).cast()) }
            };
        }
        macro_rules! both {
            ($lane:expr) => {
                _mm512_insertf32x8::<1>(_mm512_castps256_ps512(load!($lane)), load!($lane + 4))
            };
        }
        macro_rules! half {
            ($lane:expr) => {{
                let (r0, r1, r2, r3) = (both!($lane), both!($lane + 1), both!($lane + 2), both!($lane + 3));
                let xy = _mm512_castps_pd(_mm512_unpacklo_ps(r0, r1));
                let xy_on = _mm512_castps_pd(_mm512_unpacklo_ps(r2, r3));
                let z = _mm512_castps_pd(_mm512_unpackhi_ps(r0, r1));
                let z_on = _mm512_castps_pd(_mm512_unpackhi_ps(r2, r3));
                [
                    _mm512_castpd_ps(_mm512_unpacklo_pd(xy, xy_on)),
                    _mm512_castpd_ps(_mm512_unpackhi_pd(xy, xy_on)),
                    _mm512_castpd_ps(_mm512_unpacklo_pd(z, z_on)),
                ]
            }};
        }
        // Each holds a coordinate in its even and the speed along it in its odd lanes of 128 bits.
        let (low, high) = (half!(0), half!(8));
        [
            _mm512_shuffle_f32x4::<0x88>(low[0], high[0]),
            _mm512_shuffle_f32x4::<0x88>(low[1], high[1]),
            _mm512_shuffle_f32x4::<0x88>(low[2], high[2]),
            _mm512_shuffle_f32x4::<0xdd>(low[0], high[0]),
            _mm512_shuffle_f32x4::<0xdd>(low[1], high[1]),
            _mm512_shuffle_f32x4::<0xdd>(low[2], high[2]),
        ]
    }};
}

/// The same for eight records, from lane `$half` on.
#[cfg(target_arch = "x86_64")]
macro_rules! columns8 {
    ($seen:expr, $index:expr, $half:expr) => {{
        // SAFETY: as for sixteen.
        macro_rules! load {
            ($lane:expr, $part:expr) => {
                unsafe {
                    let record = $seen.as_ptr().cast::<u64>().add($index[$half + $lane] as usize);
                    _mm_load_ps(record.cast::<f32>().add($part))
                }
            };
        }
        macro_rules! three {
            ($part:expr) => {{
                macro_rules! both {
                    ($lane:expr) => {
                        _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(load!($lane, $part)), load!($lane + 4, $part))
                    };
                }
                let (r0, r1, r2, r3) = (both!(0), both!(1), both!(2), both!(3));
                let xy = _mm256_castps_pd(_mm256_unpacklo_ps(r0, r1));
                let xy_on = _mm256_castps_pd(_mm256_unpacklo_ps(r2, r3));
                let z = _mm256_castps_pd(_mm256_unpackhi_ps(r0, r1));
                let z_on = _mm256_castps_pd(_mm256_unpackhi_ps(r2, r3));
                [
                    _mm256_castpd_ps(_mm256_unpacklo_pd(xy, xy_on)),
                    _mm256_castpd_ps(_mm256_unpackhi_pd(xy, xy_on)),
                    _mm256_castpd_ps(_mm256_unpacklo_pd(z, z_on)),
                ]
            }};
        }
        let (place, speed) = (three!(0), three!(4));
        [place[0], place[1], place[2], speed[0], speed[1], speed[2]]
    }};
}

/// Turns columns x, y, z of sixteen lanes into records: vector k holds those of lanes k, k + 4, k + 8 and k + 12.
#[cfg(target_arch = "x86_64")]
macro_rules! records16 {
    ($columns:expr) => {{
        let [x, y, z] = $columns;
        let none = _mm512_setzero_ps();
        let xy = _mm512_castps_pd(_mm512_unpacklo_ps(x, y));
        let xy_on = _mm512_castps_pd(_mm512_unpackhi_ps(x, y));
        let z0 = _mm512_castps_pd(_mm512_unpacklo_ps(z, none));
        let z0_on = _mm512_castps_pd(_mm512_unpackhi_ps(z, none));
        [
            _mm512_unpacklo_pd(xy, z0),
            _mm512_unpackhi_pd(xy, z0),
            _mm512_unpacklo_pd(xy_on, z0_on),
            _mm512_unpackhi_pd(xy_on, z0_on),
        ]
    }};
}

/// The same for eight lanes.
#[cfg(target_arch = "x86_64")]
macro_rules! records8 {
    ($columns:expr) => {{
        let [x, y, z] = $columns;
        let none = _mm256_setzero_ps();
        let xy = _mm256_castps_pd(_mm256_unpacklo_ps(x, y));
        let xy_on = _mm256_castps_pd(_mm256_unpackhi_ps(x, y));
        let z0 = _mm256_castps_pd(_mm256_unpacklo_ps(z, none));
        let z0_on = _mm256_castps_pd(_mm256_unpackhi_ps(z, none));
        [
            _mm256_castpd_ps(_mm256_unpacklo_pd(xy, z0)),
            _mm256_castpd_ps(_mm256_unpackhi_pd(xy, z0)),
            _mm256_castpd_ps(_mm256_unpacklo_pd(xy_on, z0_on)),
            _mm256_castpd_ps(_mm256_unpackhi_pd(xy_on, z0_on)),
        ]
    }};
}

/// A node as its neighbours see it: one aligned load.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C, align(32))]
pub struct Seen {
    /// Position in steps of the grid, modulo 2^32; the last is padding.
    pub position: [i32; 4],
    /// Velocity [m/s]; the last is padding.
    pub velocity: [f32; 4],
}

/// How the nodes of a slice move, by axis and lane.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C, align(64))]
pub struct Motion {
    /// Positions [m].
    pub position: [[f64; LANES]; 3],
    /// Velocities [m/s].
    pub velocity: [[f64; LANES]; 3],
}

/// What acts on the nodes of a slice throughout a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C, align(64))]
pub struct Drive {
    /// Forces from outside [N].
    pub force: [[f64; LANES]; 3],
    /// Substep over mass [s/kg]; 0 holds a node in place.
    pub impulse: [f64; LANES],
    /// What is left of a velocity after a substep of viscous damping.
    pub keep: [f64; LANES],
}

/// Sixteen links, one a lane.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct LinkRow {
    /// Four times the number of the node at the other end: what a processor can scale to bytes by itself.
    pub neighbour: [u32; LANES],
    /// Stiffness K, for lengths in grid steps [N].
    pub stiffness: [f32; LANES],
    /// The constant c of the force K l + c [N].
    pub constant: [f32; LANES],
    /// Square of the length past which the slice is marked [grid steps squared].
    pub alarm_squared: [f32; LANES],
}

impl LinkRow {
    /// Links without springs to some nodes.
    fn to(nodes: &[u32; LANES]) -> Self {
        Self {
            neighbour: nodes.map(|j| 4 * j),
            stiffness: [0.0; LANES],
            constant: [0.0; LANES],
            alarm_squared: [f32::MAX; LANES],
        }
    }
}

/// Buffers of the substep loop.
#[derive(Debug, Clone, Default)]
pub struct SpringBuffers {
    /// What neighbours see, before and after the substep.
    pub seen: [Vec<Seen>; 2],
    /// Positions and velocities, a slice each.
    pub motion: Vec<Motion>,
    /// Forces from outside, a slice each.
    pub drive: Vec<Drive>,
    /// The links, in the order of [`Links`].
    pub rows: Vec<LinkRow>,
    /// 1 where a spring of the slice has passed its alarm length.
    pub alarm: Vec<u8>,
    /// Step of the grid that neighbours see positions on [m], a power of two.
    pub grid: f64,
}

impl SpringBuffers {
    /// Makes room for the links, and names the neighbours in them.
    pub fn fit(&mut self, links: &Links) {
        self.rows.clear();
        self.rows.extend(links.neighbour.iter().map(LinkRow::to));
        for side in &mut self.seen {
            side.clear();
            side.resize(links.slices() * LANES, Seen::default());
        }
        self.motion.clear();
        self.motion.resize(links.slices(), Motion::default());
        self.drive.clear();
        self.drive.resize(links.slices(), Drive::default());
        self.alarm.clear();
        self.alarm.resize(links.slices(), 0);
    }

    /// Chooses the grid for springs no longer than `longest` and nodes no farther from the origin than `farthest` [m]:
    /// a spring may grow to [`SpringBuffers::range`], four to eight times `longest`, and a node go eight times as far.
    pub fn choose_grid(&mut self, longest: f64, farthest: f64) {
        self.grid = power_of_two_above(longest * 2f64.powi(-28)).max(power_of_two_above(farthest * 2f64.powi(-48)));
    }

    /// Longest spring that the grid can tell from a shorter one [m]: an alarm goes off before it is reached.
    pub fn range(&self) -> f64 {
        self.grid * 2f64.powi(30)
    }

    /// Position of a node [m].
    pub fn position(&self, node: usize) -> [f64; 3] {
        self.motion[node / LANES].position.map(|axis| axis[node % LANES])
    }

    /// Velocity of a node [m/s].
    pub fn velocity(&self, node: usize) -> [f64; 3] {
        self.motion[node / LANES].velocity.map(|axis| axis[node % LANES])
    }

    /// Puts a node somewhere [m], at some speed [m/s], and shows it to its neighbours.
    pub fn put(&mut self, node: usize, position: [f64; 3], velocity: [f64; 3], side: usize) {
        let motion = &mut self.motion[node / LANES];
        let rounder = rounder(self.grid);
        let seen = &mut self.seen[side][node];
        for axis in 0..3 {
            motion.position[axis][node % LANES] = position[axis];
            motion.velocity[axis][node % LANES] = velocity[axis];
            seen.position[axis] = on_grid(position[axis], rounder);
            seen.velocity[axis] = velocity[axis] as f32;
        }
    }
}

/// The smallest power of two over a number, at least 2^-100.
fn power_of_two_above(value: f64) -> f64 {
    let least = 2f64.powi(-100);
    let value = if value.is_finite() { value.max(least) } else { 1.0 };
    f64::from_bits(((value.to_bits() >> 52) + 1) << 52)
}

/// What rounds a number to the grid when added: its last binary digit is one step.
fn rounder(grid: f64) -> f64 {
    1.5 * 2f64.powi(52) * grid
}

/// A position in grid steps, modulo 2^32.
#[inline(always)]
fn on_grid(value: f64, rounder: f64) -> i32 {
    (value + rounder).to_bits() as i32
}

/// What stays the same over the substeps.
#[derive(Debug, Clone, Copy)]
pub struct SubstepSettings {
    /// Substep [s].
    pub dt: f64,
    /// Damping of a spring over its stiffness [s].
    pub spring_damping: f64,
    /// Vector unit to use.
    pub unit: VectorUnit,
    /// Whether to share the work among threads.
    pub parallel: bool,
}

/// The part of the buffers that some slices write.
type SlicesOut<'a> = ((&'a mut [Seen], &'a mut [Motion]), &'a mut [u8]);

/// Advances all nodes by one substep; neighbours are read from the side `before`, and the other is written. Returns
/// whether any alarm went off.
pub fn substep(links: &Links, buffers: &mut SpringBuffers, before: usize, settings: SubstepSettings) -> bool {
    let SpringBuffers { seen, motion, drive, rows, alarm, grid } = buffers;
    let [first, second] = seen;
    let (seen, seen_after) = if before == 0 { (&*first, second) } else { (&*second, first) };
    let slices = links.slices();
    assert!(seen.len() == slices * LANES && drive.len() == slices && rows.len() == links.rows());
    let view = View {
        first_row: &links.first_row,
        rows,
        seen,
        drive,
        dt: settings.dt,
        // Stiffness counts in grid steps, damping does not.
        damping: (settings.spring_damping / *grid) as f32,
        rounder: rounder(*grid),
        unit: settings.unit,
    };
    let nodes_a_task = SLICES_A_TASK * LANES;
    if settings.parallel {
        let parts = seen_after
            .par_chunks_mut(nodes_a_task)
            .zip(motion.par_chunks_mut(SLICES_A_TASK))
            .zip(alarm.par_chunks_mut(SLICES_A_TASK));
        for_each_task(parts, |task, out| view.slices(task * SLICES_A_TASK, out));
    } else {
        view.slices(0, ((seen_after, motion), alarm));
    }
    alarm.iter().any(|a| *a != 0)
}

/// What a substep reads.
struct View<'a> {
    first_row: &'a [u32],
    rows: &'a [LinkRow],
    seen: &'a [Seen],
    drive: &'a [Drive],
    dt: f64,
    damping: f32,
    rounder: f64,
    unit: VectorUnit,
}

impl View<'_> {
    /// The slices from `first` on, as many as there is room for.
    fn slices(&self, first: usize, out: SlicesOut<'_>) {
        #[cfg(target_arch = "x86_64")]
        match self.unit {
            // SAFETY: `VectorUnit::best` and `available` only name what the processor was found to have.
            VectorUnit::Avx512 => return unsafe { self.slices_avx512(first, out) },
            // SAFETY: as above.
            VectorUnit::Avx2 => return unsafe { self.slices_avx2(first, out) },
            VectorUnit::Portable => {}
        }
        self.slices_portable(first, out);
    }

    /// The rows of a slice.
    #[inline(always)]
    fn rows_of(&self, slice: usize) -> &[LinkRow] {
        &self.rows[self.first_row[slice] as usize..self.first_row[slice + 1] as usize]
    }

    /// Eq. 6.6: v += h F / m, damped implicitly; x += h v.
    fn slices_portable(&self, first: usize, ((seen_after, motion), alarm): SlicesOut<'_>) {
        for (k, motion) in motion.iter_mut().enumerate() {
            let slice = first + k;
            let (force, rings) = self.forces_portable(slice);
            alarm[k] = u8::from(rings);
            let drive = &self.drive[slice];
            for (lane, seen) in seen_after[k * LANES..(k + 1) * LANES].iter_mut().enumerate() {
                for axis in 0..3 {
                    let (position, velocity) = (&mut motion.position[axis][lane], &mut motion.velocity[axis][lane]);
                    let total = f64::from(force[axis][lane]) + drive.force[axis][lane];
                    *velocity = quantised(total.mul_add(drive.impulse[lane], *velocity) * drive.keep[lane]);
                    *position = velocity.mul_add(self.dt, *position);
                    seen.position[axis] = on_grid(*position, self.rounder);
                    seen.velocity[axis] = *velocity as f32;
                }
            }
        }
    }

    /// Forces of the springs on the nodes of a slice [N], and whether an alarm goes off.
    fn forces_portable(&self, slice: usize) -> ([[f32; LANES]; 3], bool) {
        let here = &self.seen[slice * LANES..(slice + 1) * LANES];
        let mut force = [[0f32; LANES]; 3];
        let mut rings = false;
        for row in self.rows_of(slice) {
            for lane in 0..LANES {
                let there = &self.seen[row.neighbour[lane] as usize / 4];
                let here = &here[lane];
                let [x, y, z] = [0, 1, 2].map(|axis| there.position[axis].wrapping_sub(here.position[axis]) as f32);
                let w = [0, 1, 2].map(|axis| there.velocity[axis] - here.velocity[axis]);
                let length_squared = z.mul_add(z, y.mul_add(y, x * x));
                // A lane without a link has length 0: any length will do, for it has no stiffness.
                let inverse = 1.0 / length_squared.max(1.0).sqrt();
                let closing = w[2].mul_add(z, w[1].mul_add(y, w[0] * x)) * inverse;
                let stiffness = row.stiffness[lane];
                let rest = (stiffness * self.damping).mul_add(closing, row.constant[lane]);
                let scale = rest.mul_add(inverse, stiffness);
                force[0][lane] = scale.mul_add(x, force[0][lane]);
                force[1][lane] = scale.mul_add(y, force[1][lane]);
                force[2][lane] = scale.mul_add(z, force[2][lane]);
                rings |= length_squared > row.alarm_squared[lane];
            }
        }
        (force, rings)
    }

    /// The same operations in the same order, eight lanes at once.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn slices_avx2(&self, first: usize, ((seen_after, motion), alarm): SlicesOut<'_>) {
        use std::arch::x86_64::*;
        let damping = _mm256_set1_ps(self.damping);
        let one = _mm256_set1_ps(1.0);
        let (dt, rounder, quantum) = (_mm256_set1_pd(self.dt), _mm256_set1_pd(self.rounder), _mm256_set1_pd(QUANTISER));
        for (k, motion) in motion.iter_mut().enumerate() {
            let slice = first + k;
            let (rows, drive) = (self.rows_of(slice), &self.drive[slice]);
            let after = &mut seen_after[k * LANES..(k + 1) * LANES];
            let mut alarms = 0;
            for half in [0, 8] {
                let own: [u32; LANES] = std::array::from_fn(|lane| 4 * (slice * LANES + lane) as u32);
                let [here_x, here_y, here_z, own_u, own_v, own_w] = columns8!(self.seen, own, half);
                let mut force = [_mm256_setzero_ps(); 3];
                let mut rings = _mm256_setzero_ps();
                for row in rows {
                    let [x, y, z, u, v, w] = columns8!(self.seen, row.neighbour, half);
                    let apart = |there: __m256, here: __m256| {
                        let steps = _mm256_sub_epi32(_mm256_castps_si256(there), _mm256_castps_si256(here));
                        _mm256_cvtepi32_ps(steps)
                    };
                    let (x, y, z) = (apart(x, here_x), apart(y, here_y), apart(z, here_z));
                    let (u, v, w) = (_mm256_sub_ps(u, own_u), _mm256_sub_ps(v, own_v), _mm256_sub_ps(w, own_w));
                    // SAFETY: a LinkRow holds sixteen f32 in each array, at 64-byte alignment.
                    let (stiffness, constant, alarm_squared) = unsafe {
                        (
                            _mm256_load_ps(row.stiffness.as_ptr().add(half)),
                            _mm256_load_ps(row.constant.as_ptr().add(half)),
                            _mm256_load_ps(row.alarm_squared.as_ptr().add(half)),
                        )
                    };
                    let length_squared = _mm256_fmadd_ps(z, z, _mm256_fmadd_ps(y, y, _mm256_mul_ps(x, x)));
                    let inverse = _mm256_div_ps(one, _mm256_sqrt_ps(_mm256_max_ps(length_squared, one)));
                    let along = _mm256_fmadd_ps(w, z, _mm256_fmadd_ps(v, y, _mm256_mul_ps(u, x)));
                    let closing = _mm256_mul_ps(along, inverse);
                    let rest = _mm256_fmadd_ps(_mm256_mul_ps(stiffness, damping), closing, constant);
                    let scale = _mm256_fmadd_ps(rest, inverse, stiffness);
                    force[0] = _mm256_fmadd_ps(scale, x, force[0]);
                    force[1] = _mm256_fmadd_ps(scale, y, force[1]);
                    force[2] = _mm256_fmadd_ps(scale, z, force[2]);
                    rings = _mm256_or_ps(rings, _mm256_cmp_ps::<_CMP_GT_OQ>(length_squared, alarm_squared));
                }
                alarms |= _mm256_movemask_ps(rings);
                let mut fixed = [_mm256_setzero_ps(); 3];
                let mut rounded = [_mm256_setzero_ps(); 3];
                for axis in 0..3 {
                    let parts = [_mm256_castps256_ps128(force[axis]), _mm256_extractf128_ps::<1>(force[axis])];
                    let mut places = [_mm256_setzero_ps(); 2];
                    let mut speeds = [_mm_setzero_ps(); 2];
                    for quarter in 0..2 {
                        let lane = half + 4 * quarter;
                        // SAFETY: sixteen f64 in each array, at 64-byte alignment; `lane` is 0, 4, 8 or 12.
                        unsafe {
                            let at_position = motion.position[axis].as_mut_ptr().add(lane);
                            let at_velocity = motion.velocity[axis].as_mut_ptr().add(lane);
                            let outside = _mm256_load_pd(drive.force[axis].as_ptr().add(lane));
                            let total = _mm256_add_pd(_mm256_cvtps_pd(parts[quarter]), outside);
                            let impulse = _mm256_load_pd(drive.impulse.as_ptr().add(lane));
                            let pushed = _mm256_fmadd_pd(total, impulse, _mm256_load_pd(at_velocity));
                            let kept = _mm256_mul_pd(pushed, _mm256_load_pd(drive.keep.as_ptr().add(lane)));
                            let velocity = _mm256_sub_pd(_mm256_add_pd(kept, quantum), quantum);
                            let position = _mm256_fmadd_pd(velocity, dt, _mm256_load_pd(at_position));
                            _mm256_store_pd(at_velocity, velocity);
                            _mm256_store_pd(at_position, position);
                            places[quarter] = _mm256_castpd_ps(_mm256_add_pd(position, rounder));
                            speeds[quarter] = _mm256_cvtpd_ps(velocity);
                        }
                    }
                    // The low halves of eight f64: the pairs come out as 0 2 1 3.
                    let low = _mm256_castps_pd(_mm256_shuffle_ps::<0x88>(places[0], places[1]));
                    fixed[axis] = _mm256_castpd_ps(_mm256_permute4x64_pd::<0b11_01_10_00>(low));
                    rounded[axis] = _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(speeds[0]), speeds[1]);
                }
                let places = records8!(fixed);
                let speeds = records8!(rounded);
                let after = &mut after[half..half + 8];
                for lane in 0..4 {
                    let near = _mm256_permute2f128_ps::<0x20>(places[lane], speeds[lane]);
                    let far = _mm256_permute2f128_ps::<0x31>(places[lane], speeds[lane]);
                    // SAFETY: `after` has eight records of eight aligned 4-byte numbers from here on.
                    unsafe {
                        _mm256_store_ps(after.as_mut_ptr().add(lane).cast(), near);
                        _mm256_store_ps(after.as_mut_ptr().add(lane + 4).cast(), far);
                    }
                }
            }
            alarm[k] = u8::from(alarms != 0);
        }
    }

    /// The same operations in the same order, sixteen lanes at once.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx2,fma")]
    fn slices_avx512(&self, first: usize, ((seen_after, motion), alarm): SlicesOut<'_>) {
        use std::arch::x86_64::*;
        let damping = _mm512_set1_ps(self.damping);
        let one = _mm512_set1_ps(1.0);
        let (dt, rounder, quantum) = (_mm512_set1_pd(self.dt), _mm512_set1_pd(self.rounder), _mm512_set1_pd(QUANTISER));
        // Lanes of 128 bits 0 and 1, or 2 and 3, of a first vector between those of a second.
        let near_lanes = _mm512_setr_epi64(0, 1, 8, 9, 2, 3, 10, 11);
        let far_lanes = _mm512_setr_epi64(4, 5, 12, 13, 6, 7, 14, 15);
        for (k, motion) in motion.iter_mut().enumerate() {
            let slice = first + k;
            let (rows, drive) = (self.rows_of(slice), &self.drive[slice]);
            let own: [u32; LANES] = std::array::from_fn(|lane| 4 * (slice * LANES + lane) as u32);
            let [here_x, here_y, here_z, own_u, own_v, own_w] = columns16!(self.seen, own);
            let mut force = [_mm512_setzero_ps(); 3];
            let mut rings: __mmask16 = 0;
            // Square root and division take longer than all else together: each row is finished while the next is on its
            // way through them.
            let mut before: Option<(&LinkRow, [__m512; 5])> = None;
            macro_rules! finish {
                () => {
                    if let Some((row, [x, y, z, along, inverse])) = before {
                        // SAFETY: a LinkRow holds sixteen f32 in each array, at 64-byte alignment.
                        let (stiffness, constant) =
                            unsafe { (_mm512_load_ps(row.stiffness.as_ptr()), _mm512_load_ps(row.constant.as_ptr())) };
                        let closing = _mm512_mul_ps(along, inverse);
                        let rest = _mm512_fmadd_ps(_mm512_mul_ps(stiffness, damping), closing, constant);
                        let scale = _mm512_fmadd_ps(rest, inverse, stiffness);
                        force[0] = _mm512_fmadd_ps(scale, x, force[0]);
                        force[1] = _mm512_fmadd_ps(scale, y, force[1]);
                        force[2] = _mm512_fmadd_ps(scale, z, force[2]);
                    }
                };
            }
            for row in rows {
                let ahead = std::ptr::from_ref(row).wrapping_add(AHEAD).cast::<i8>();
                for line in 0..4 {
                    _mm_prefetch::<_MM_HINT_T0>(ahead.wrapping_add(64 * line));
                }
                let [x, y, z, u, v, w] = columns16!(self.seen, row.neighbour);
                let apart = |there: __m512, here: __m512| {
                    let steps = _mm512_sub_epi32(_mm512_castps_si512(there), _mm512_castps_si512(here));
                    _mm512_cvtepi32_ps(steps)
                };
                let (x, y, z) = (apart(x, here_x), apart(y, here_y), apart(z, here_z));
                let (u, v, w) = (_mm512_sub_ps(u, own_u), _mm512_sub_ps(v, own_v), _mm512_sub_ps(w, own_w));
                // SAFETY: a LinkRow holds sixteen f32 in each array, at 64-byte alignment.
                let alarm_squared = unsafe { _mm512_load_ps(row.alarm_squared.as_ptr()) };
                let length_squared = _mm512_fmadd_ps(z, z, _mm512_fmadd_ps(y, y, _mm512_mul_ps(x, x)));
                rings |= _mm512_cmp_ps_mask::<_CMP_GT_OQ>(length_squared, alarm_squared);
                let inverse = _mm512_div_ps(one, _mm512_sqrt_ps(_mm512_max_ps(length_squared, one)));
                let along = _mm512_fmadd_ps(w, z, _mm512_fmadd_ps(v, y, _mm512_mul_ps(u, x)));
                finish!();
                before = Some((row, [x, y, z, along, inverse]));
            }
            finish!();
            alarm[k] = u8::from(rings != 0);
            let mut fixed = [_mm512_setzero_ps(); 3];
            let mut rounded = [_mm512_setzero_ps(); 3];
            for axis in 0..3 {
                let parts = [_mm512_castps512_ps256(force[axis]), _mm512_extractf32x8_ps::<1>(force[axis])];
                let mut places = [_mm256_setzero_si256(); 2];
                let mut speeds = [_mm256_setzero_ps(); 2];
                for half in 0..2 {
                    let lane = 8 * half;
                    // SAFETY: sixteen f64 in each array, at 64-byte alignment; `lane` is 0 or 8.
                    unsafe {
                        let at_position = motion.position[axis].as_mut_ptr().add(lane);
                        let at_velocity = motion.velocity[axis].as_mut_ptr().add(lane);
                        let outside = _mm512_load_pd(drive.force[axis].as_ptr().add(lane));
                        let total = _mm512_add_pd(_mm512_cvtps_pd(parts[half]), outside);
                        let impulse = _mm512_load_pd(drive.impulse.as_ptr().add(lane));
                        let pushed = _mm512_fmadd_pd(total, impulse, _mm512_load_pd(at_velocity));
                        let kept = _mm512_mul_pd(pushed, _mm512_load_pd(drive.keep.as_ptr().add(lane)));
                        let velocity = _mm512_sub_pd(_mm512_add_pd(kept, quantum), quantum);
                        let position = _mm512_fmadd_pd(velocity, dt, _mm512_load_pd(at_position));
                        _mm512_store_pd(at_velocity, velocity);
                        _mm512_store_pd(at_position, position);
                        places[half] = _mm512_cvtepi64_epi32(_mm512_castpd_si512(_mm512_add_pd(position, rounder)));
                        speeds[half] = _mm512_cvtpd_ps(velocity);
                    }
                }
                fixed[axis] =
                    _mm512_castsi512_ps(_mm512_inserti64x4::<1>(_mm512_castsi256_si512(places[0]), places[1]));
                rounded[axis] = _mm512_insertf32x8::<1>(_mm512_castps256_ps512(speeds[0]), speeds[1]);
            }
            let places = records16!(fixed);
            let speeds = records16!(rounded);
            let after = &mut seen_after[k * LANES..(k + 1) * LANES];
            for lane in 0..4 {
                let near = _mm512_permutex2var_pd(places[lane], near_lanes, speeds[lane]);
                let far = _mm512_permutex2var_pd(places[lane], far_lanes, speeds[lane]);
                // SAFETY: `after` has sixteen records of four aligned f64's size.
                unsafe {
                    let mut at = |offset: usize| -> *mut f64 { after.as_mut_ptr().add(lane + offset).cast() };
                    _mm256_store_pd(at(0), _mm512_castpd512_pd256(near));
                    _mm256_store_pd(at(4), _mm512_extractf64x4_pd::<1>(near));
                    _mm256_store_pd(at(8), _mm512_castpd512_pd256(far));
                    _mm256_store_pd(at(12), _mm512_extractf64x4_pd::<1>(far));
                }
            }
        }
    }
}

/// Rows between the one in hand and the one asked of memory. // tuned: 4 to 32, flat between 8 and 16
const AHEAD: usize = 8;

/// Adding and taking away 1.5 x 2^-8 leaves no room for digits below 2^-60.
const QUANTISER: f64 = 1.5 / 256.0;

/// Rounds a velocity to a multiple of 2^-60, or to the precision of f64 where that is coarser: where nothing has arrived
/// yet, numbers would else fade through the denormal range, where processors are a hundred times slower.
#[inline(always)]
fn quantised(value: f64) -> f64 {
    (value + QUANTISER) - QUANTISER
}
