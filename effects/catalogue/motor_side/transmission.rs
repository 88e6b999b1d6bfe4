//! One time step of a rotor and its drive, coupled to a joint by a spring, a gap, or both.
//!
//! The drive's law on the rotor is `a - b θ - d ω` (angle `θ`, speed `ω`, inertia `J`, all seen
//! from the joint). Between rotor and joint are a spring of compliance `C`, a damper in parallel
//! with it and a gap of width `w`. One step of `dt` is
//!
//! `J (ω1 - ω) / dt = a - b (θ + s dt ω1 - g dt ω) - d ω1 - T`,
//! `C T = θ - q ∓ w/2 + s' dt (ω1 - v1) - g' dt (ω - v) + τ (ω1 - v1)`,
//! `θ1 = θ + ω1 dt`, `q1 = q + v1 dt`.
//!
//! The transmitted force `T` is therefore linear in the joint's speed at the end of the step. With
//! `σ = s' dt + τ`,
//!
//! `T = K (θ - q ∓ w/2 - g' dt (ω - v) + σ X / A) - K σ v1`, with `A = J/dt + s b dt + d`,
//! `X = (J/dt + g b dt) ω + a - b θ`, `K = 1 / (C + σ / A)`.
//!
//! The first part is applied as a force, and `K σ` as damping of the joint, which engines integrate
//! implicitly. The scheme is stable at any stiffness of the spring, and the ends of a gap are rigid
//! and do not bounce. As `C` and `w` vanish it becomes the drive at the joint with the rotor's
//! inertia added. The joint's displacement tells the impulse that the damping took over the step,
//! however an engine integrates it: with `v1 = (q1 - q) / dt`, rotor and joint exchange equal
//! impulses. A rotor without inertia needs a law with `b` or `d`.
//!
//! The damper models the transmission's own loss: with `τ = 2 ζ sqrt(J C)` the rotor swings against
//! a fixed joint at a damping ratio `ζ`. The numerical loss of the step must not hide it. With
//! `s = 1` and `g = 0` (backward Euler) that loss equals a damper of `dt`, which at 1 ms exceeds
//! that of the steel gears of a hand-sized servo. With `s = g = 1/4` a spring loses nothing. Its
//! swing then has the period of the trapezoidal rule and is stable at any stiffness.
//!
//! Stiff parts must not swing, however. A spring of very small compliance and the ends of a gap are
//! rigid, with `s = 1`. A rotor without inertia moves within its gap to where its drive pulls it:
//! there `s = 1 / (1 - exp(-x)) - 1 / x` with `x = b dt / d` gives the speed of continuous time
//! (exponential Euler). Each spring is therefore a mix of both cases, weighted by how much its
//! rotor's inertia or its compliance counts over a step: [`Share`].

/// What lies between a rotor and its joint.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Between {
    /// Compliance, rad/(N m) or m/N.
    pub(super) compliance: f64,
    /// Damping ratio of the rotor's swing on the spring.
    pub(super) loss: f64,
    /// Half of the gap, rad or m.
    pub(super) half_gap: f64,
}

/// Weights of the speeds, in time steps, in the deflection that a step uses for a spring.
///
/// `late` weighs the speed at the end of the step, `early` (negatively) that at its beginning: `s`
/// and `g` above.
#[derive(Clone, Copy, Debug)]
struct Share {
    late: f64,
    early: f64,
}

impl Share {
    /// The trapezoidal rule for the share `swings` (0 to 1), `creeping` for the rest.
    fn of(swings: f64, creeping: f64) -> Self {
        Self {
            late: 0.25 * swings + creeping * (1.0 - swings),
            early: 0.25 * swings,
        }
    }
}

/// The weight `late` of a spring that relaxes against a damper, for a step of `x` time constants.
///
/// It is the middle of a short step and the end of a long one, so that the relaxation is that of
/// continuous time.
fn exponential(x: f64) -> f64 {
    if x < 1e-4 {
        return 0.5 + x / 12.0;
    }
    -1.0 / (-x).exp_m1() - 1.0 / x
}

/// A drive's force on its rotor, `a - b θ - d ω`, seen from the joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Law {
    pub(super) a: f64,
    pub(super) b: f64,
    pub(super) d: f64,
}

/// A step that has begun; [`Transmission::complete`] ends it once the joint has moved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Begun {
    pub(super) law: Law,
    /// `A` and `X`, as above.
    resistance: f64,
    push: f64,
    /// The transmitted force is `force - damping v1`.
    pub(super) force: f64,
    pub(super) damping: f64,
    /// Position of the joint at the beginning.
    from: f64,
}

impl Begun {
    /// All of it as numbers, to be saved.
    pub(super) fn numbers(&self) -> [f64; 8] {
        let Law { a, b, d } = self.law;
        let (resistance, push) = (self.resistance, self.push);
        [
            a,
            b,
            d,
            resistance,
            push,
            self.force,
            self.damping,
            self.from,
        ]
    }

    /// Restores it from saved numbers.
    pub(super) fn of(numbers: &[f64]) -> Option<Self> {
        let [a, b, d, resistance, push, force, damping, from] =
            <[f64; 8]>::try_from(numbers).ok()?;
        Some(Self {
            law: Law { a, b, d },
            resistance,
            push,
            force,
            damping,
            from,
        })
    }
}

/// A rotor coupled to its joint. Its state is its angle and its speed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transmission {
    /// What lies between.
    pub(super) between: Between,
    /// Inertia of the rotor, seen from the joint.
    pub(super) inertia: f64,
    /// Time step, s.
    pub(super) dt: f64,
}

impl Transmission {
    /// `A` and `X` of a law, for a rotor that pushes its joint (`pushes`) or one that moves freely.
    fn coefficients(&self, law: Law, [angle, speed]: [f64; 2], pushes: bool) -> (f64, f64) {
        let inertia = self.inertia / self.dt;
        let spring = law.b * self.dt;
        let whole = inertia + spring + law.d;
        if whole <= 0.0 {
            return (0.0, law.a - law.b * angle);
        }
        let share = if pushes {
            // The damper acts on the joint's inertia too, so that the rotor does not creep alone.
            Share::of((inertia + law.d) / whole, 1.0)
        } else if law.d > 0.0 {
            Share::of(inertia / whole, exponential(spring / law.d))
        } else {
            Share::of(inertia / whole, 1.0)
        };
        (
            inertia + share.late * spring + law.d,
            (inertia + share.early * spring) * speed + law.a - law.b * angle,
        )
    }

    /// Begins a step with a law, at a joint's position and speed.
    pub(super) fn begin(&self, law: Law, rotor: [f64; 2], q: f64, v: f64) -> Begun {
        let dt = self.dt;
        let begun = |resistance, push| Begun {
            law,
            resistance,
            push,
            force: 0.0,
            damping: 0.0,
            from: q,
        };
        let (resistance, push) = self.coefficients(law, rotor, false);
        if resistance <= 0.0 {
            // Nothing resists the rotor: it transmits its drive's force.
            return Begun {
                force: law.a,
                ..begun(resistance, push)
            };
        }
        let stretch = rotor[0] - q + dt * (push / resistance - v);
        if stretch.abs() < self.between.half_gap {
            return begun(resistance, push);
        }
        let (resistance, push) = self.coefficients(law, rotor, true);
        let share = Share::of(
            self.between.compliance / (self.between.compliance + dt / resistance),
            1.0,
        );
        let damper = 2.0 * self.between.loss * (self.inertia * self.between.compliance).sqrt();
        let seconds = share.late * dt + damper;
        let stiffness = 1.0 / (self.between.compliance + seconds / resistance);
        let twist = rotor[0] - q - self.between.half_gap.copysign(stretch);
        let pulled = twist - share.early * dt * (rotor[1] - v);
        Begun {
            force: stiffness * (pulled + seconds * push / resistance),
            damping: stiffness * seconds,
            ..begun(resistance, push)
        }
    }

    /// The rotor after a step that ended with the joint at `q`.
    pub(super) fn complete(&self, begun: &Begun, rotor: [f64; 2], q: f64) -> [f64; 2] {
        let v = (q - begun.from) / self.dt;
        let force = begun.force - begun.damping * v;
        let Begun {
            resistance, push, ..
        } = *begun;
        if resistance <= 0.0 {
            let stretch = self.between.compliance * force + self.between.half_gap * force.signum();
            return [q + stretch, v];
        }
        let speed = (push - force) / resistance;
        [rotor[0] + speed * self.dt, speed]
    }

    /// Angle and speed of a rotor in balance with its joint, at whose speed it moves.
    ///
    /// `gives` is the force of the drive where its law asks for one: less at a limit.
    pub(super) fn settled(&self, law: Law, gives: impl Fn(f64) -> f64, q: f64, v: f64) -> [f64; 2] {
        let Between {
            compliance,
            half_gap,
            ..
        } = self.between;
        let push = law.a - law.d * v;
        let end = if law.b > 0.0 {
            (push / law.b).clamp(q - half_gap, q + half_gap)
        } else if push == 0.0 {
            q
        } else {
            q + half_gap.copysign(push)
        };
        let angle = (end + compliance * push) / (1.0 + compliance * law.b);
        let asked = push - law.b * angle;
        let given = gives(asked);
        if given == asked {
            return [angle, v];
        }
        // At its limit the drive winds the spring by what it gives, whatever it asks for.
        [q + half_gap.copysign(given) + compliance * given, v]
    }

    /// State of the rotor after its joint was placed elsewhere; `from` and `to` are position and
    /// speed.
    ///
    /// In balance the spring's force changes as the drive's does, so that the rotor follows by the
    /// share `1 / (1 + C b)`: fully behind a stiff spring, and not at all within its gap.
    pub(super) fn taken_along(
        &self,
        law: Law,
        rotor: [f64; 2],
        (from, to): ([f64; 2], [f64; 2]),
    ) -> [f64; 2] {
        let is_free = (rotor[0] - from[0]).abs() < self.between.half_gap;
        let follows = if is_free {
            0.0
        } else {
            1.0 / (1.0 + self.between.compliance * law.b)
        };
        let mut moved = [0, 1].map(|i| rotor[i] + follows * (to[i] - from[i]));
        if is_free {
            moved[0] = moved[0].clamp(to[0] - self.between.half_gap, to[0] + self.between.half_gap);
        }
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 1e-3;

    fn rotor(inertia: f64, between: Between) -> Transmission {
        Transmission {
            between,
            inertia,
            dt: DT,
        }
    }

    /// `θ = θ∞ (1 - exp(-b t / d))`, at any time step.
    #[test]
    fn a_rotor_without_inertia_relaxes_in_its_gap_as_in_continuous_time() {
        for d in [1e-3, 0.1, 3.0] {
            let between = Between {
                half_gap: 2.0,
                ..Between::default()
            };
            let transmission = rotor(0.0, between);
            let law = Law {
                a: 20.0,
                b: 20.0,
                d,
            };
            let mut state = [0.0, 0.0];
            for k in 1..50 {
                let begun = transmission.begin(law, state, 0.0, 0.0);
                state = transmission.complete(&begun, state, 0.0);
                let expected = -(-20.0 * DT * f64::from(k) / d).exp_m1();
                assert!((state[0] - expected).abs() < 1e-12, "{d} {k}");
            }
        }
    }

    /// Largest angles in the first and the eleventh period of a rotor on its spring, the joint
    /// fixed.
    fn swings(loss: f64) -> [f64; 2] {
        let (inertia, compliance) = (0.02, 0.05);
        let between = Between {
            compliance,
            loss,
            half_gap: 0.0,
        };
        let transmission = rotor(inertia, between);
        let law = Law {
            a: 0.0,
            b: 0.0,
            d: 0.0,
        };
        let period = std::f64::consts::TAU * f64::sqrt(inertia * compliance);
        let steps = |periods: f64| (periods * period / DT) as usize;
        let mut state = [0.3, 0.0];
        let mut angles = Vec::new();
        for _ in 0..steps(11.0) {
            angles.push(state[0]);
            let begun = transmission.begin(law, state, 0.0, 0.0);
            state = transmission.complete(&begun, state, 0.0);
        }
        [0.0, 10.0].map(|first| {
            let period = &angles[steps(first)..steps(first + 1.0)];
            period.iter().copied().fold(0.0, f64::max)
        })
    }

    #[test]
    fn a_rotor_swings_on_its_spring_by_the_loss_that_is_said() {
        let [first, last] = swings(0.0);
        assert!((last / first - 1.0).abs() < 2e-3, "{first} {last}");
        let loss = 0.03;
        let [first, last] = swings(loss);
        let expected = (-std::f64::consts::TAU * 10.0 * loss / (1.0 - loss * loss).sqrt()).exp();
        assert!(
            (last / first / expected - 1.0).abs() < 0.02,
            "{first} {last}"
        );
    }

    /// By hand: the force of a servo at rest, and the damping that it adds.
    #[test]
    fn a_rotor_that_nothing_parts_from_its_joint_is_the_drive() {
        let transmission = rotor(0.0, Between::default());
        let law = Law {
            a: 6.0,
            b: 10.0,
            d: 2.0,
        };
        let begun = transmission.begin(law, [0.4, 0.0], 0.4, 0.0);
        assert!((begun.force - 2.0).abs() < 1e-12);
        assert!((begun.damping - 2.0).abs() < 5e-3);
    }

    /// In balance the spring transmits what the drive gives, at its limit and at the joint's speed.
    #[test]
    fn a_settled_spring_is_wound_by_the_force_of_its_drive() {
        let between = Between {
            compliance: 0.01,
            ..Between::default()
        };
        let transmission = rotor(0.1, between);
        let (q, v) = (0.3, 2.0);
        for (law, limit) in [
            // A position servo, free and at its limit.
            ([30.0, 20.0, 1.0], 100.0),
            ([3000.0, 2000.0, 1.0], 5.0),
            // A velocity servo that moves as it is asked to.
            ([10.0, 0.0, 5.0], 100.0),
            ([-40.0, 0.0, 5.0], 7.0),
        ] {
            let [a, b, d] = law;
            let law = Law { a, b, d };
            let gives = |asked: f64| asked.clamp(-limit, limit);
            let [angle, speed] = transmission.settled(law, gives, q, v);
            let force = gives(a - b * angle - d * speed);
            assert!((angle - q - between.compliance * force).abs() < 1e-12);
            assert_eq!(speed, v);
        }
    }
}
