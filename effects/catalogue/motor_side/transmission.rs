//! A step of a rotor with its drive, coupled to its joint by a spring, a gap, or both.
//!
//! With the drive's law `a - b θ - d ω` on the rotor (angle `θ`, speed `ω`, inertia `J`, all seen
//! from the joint), a spring of compliance `C` between rotor and joint, a damper beside it and a gap of `w`, one step of
//! `dt` is
//!
//! `J (ω1 - ω) / dt = a - b (θ + s dt ω1 - g dt ω) - d ω1 - T`,
//! `C T = θ - q ∓ w/2 + s' dt (ω1 - v1) - g' dt (ω - v) + τ (ω1 - v1)`,
//! `θ1 = θ + ω1 dt`, `q1 = q + v1 dt`,
//!
//! so the transmitted force is linear in the joint's speed at the end of the step: with `σ = s' dt + τ`,
//!
//! `T = K (θ - q ∓ w/2 - g' dt (ω - v) + σ X / A) - K σ v1`, with `A = J/dt + s b dt + d`,
//! `X = (J/dt + g b dt) ω + a - b θ`, `K = 1 / (C + σ / A)`.
//!
//! The first part is applied as a force and `K σ` as damping of the joint, which engines
//! integrate implicitly: it is stable however stiff the spring is, a gap's ends are rigid and do
//! not bounce, and as `C` and `w` vanish it becomes the drive at the joint with the rotor's inertia
//! added. What the damping took over the step, however an engine divides it, follows from the way that
//! the joint went: `v1` is then `(q1 - q) / dt`, so that rotor and joint exchange equal impulses. A
//! rotor without inertia needs a law with `b` or `d`.
//!
//! The damper is the transmission's own loss: `τ = 2 ζ sqrt(J C)` has the rotor swing against a joint that is held with a damping ratio `ζ`.
//! A spring of the step's own loss would hide it: with `s = 1` and `g = 0` (backward Euler) that is a damper of `dt`, at 1 ms more than
//! the steel of a hand-sized servo's gears. With `s = g = 1/4` a spring loses nothing, and its swing has the period of the trapezoidal rule, stable at any
//! stiffness. But what can hardly swing should not: a spring that hardly gives, and the ends of
//! a gap, are rigid, with `s = 1`, and a rotor without inertia in its gap goes to where its drive has it, by `s = 1 / (1 - exp(-x)) - 1 / x` with
//! `x = b dt / d` exactly as fast as without steps (exponential Euler). So each spring is shared between the two, by how much its rotor's inertia or its
//! compliance counts over a step: [`Share`].

/// What lies between a rotor and its joint.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Between {
    /// Compliance, rad/(N m) or m/N.
    pub(super) compliance: f64,
    /// Damping ratio of the rotor on it.
    pub(super) loss: f64,
    /// Half of the gap, rad or m.
    pub(super) half_gap: f64,
}

/// How a step takes a spring: at what it gives way by until then, and `late` and `early` steps' worth of the speeds at its end and at its beginning.
#[derive(Clone, Copy, Debug)]
struct Share {
    late: f64,
    early: f64,
}

impl Share {
    /// The trapezoidal rule for a share that swings (0 to 1), `creeping` for the rest.
    fn of(swings: f64, creeping: f64) -> Self {
        Self {
            late: 0.25 * swings + creeping * (1.0 - swings),
            early: 0.25 * swings,
        }
    }
}

/// When in a step a spring is taken that relaxes against a damper, the step being `x` of their time constants: in its middle where it is a small part
/// of one, at its end where it is many. The relaxation is then that of a continuous time.
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

/// A step that was begun, to be completed once the joint's speed after it is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Begun {
    pub(super) law: Law,
    /// `A` and `X`.
    resistance: f64,
    push: f64,
    /// Transmitted force `force - damping v1`.
    pub(super) force: f64,
    pub(super) damping: f64,
    /// Where the joint was.
    from: f64,
}

impl Begun {
    /// All of it, to be remembered.
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

    /// From what was remembered.
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

/// A rotor behind what lies between it and its joint. Its state is its angle and its speed.
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
    /// `A` and `X` of a law, for a rotor that pushes its joint or one that is free of it.
    fn coefficients(&self, law: Law, [angle, speed]: [f64; 2], pushes: bool) -> (f64, f64) {
        let inertia = self.inertia / self.dt;
        let spring = law.b * self.dt;
        let whole = inertia + spring + law.d;
        if whole <= 0.0 {
            return (0.0, law.a - law.b * angle);
        }
        let share = if pushes {
            // With the joint's inertia, its damper does not let it creep.
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

    /// The step that a law begins at a joint's position and speed.
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
            // Nothing holds the rotor back: its drive's force passes.
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

    /// Where a rotor at rest with its joint would be.
    pub(super) fn settled(&self, law: Law, q: f64, v: f64) -> [f64; 2] {
        let end = if law.b > 0.0 {
            (law.a / law.b).clamp(q - self.between.half_gap, q + self.between.half_gap)
        } else if law.a == 0.0 {
            q
        } else {
            q + self.between.half_gap.copysign(law.a)
        };
        let angle =
            (end + self.between.compliance * law.a) / (1.0 + self.between.compliance * law.b);
        [angle, v]
    }

    /// A rotor whose joint was placed elsewhere, `from` and `to` a position and a speed. In balance the spring pulls as much more as the drive
    /// does, so that the rotor follows by `1 / (1 + C b)`: all of the way behind a stiff spring, and not at all within its gap.
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

    /// `θ = θ∞ (1 - exp(-b t / d))`, whatever the step.
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

    /// Largest angles in the first of some hundred periods and in the last, of a rotor that swings on its spring against a joint that is held.
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

    /// By hand: at rest a servo's force, and at a speed what its damper takes of it.
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
}
