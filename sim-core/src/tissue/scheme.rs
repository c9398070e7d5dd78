//! What an integrator keeps between steps, and when it must forget it.
//!
//! A one-step form keeps nothing. Verlet keeps velocities of half steps, BDF2 the state one step ago, XPBD its multipliers. After an event (reset,
//! grasp, release, another topology) the history is that of another system: [`Scheme::restart`] drops it, and the next
//! step starts from positions and velocities alone. Memory is taken when the scheme is chosen, never in a step.

use crate::tissue::bdf2::Bdf2;
use crate::tissue::integrator::Integrator;
use crate::tissue::network::SpringNetwork;
use crate::tissue::verlet::Staggered;
use crate::tissue::xpbd::SpringProjection;

/// Whether what was kept from the last step still holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum History {
    /// Nothing is known but positions and velocities.
    Fresh,
    /// The last step was of the same system.
    Running,
}

/// State of an integrator beyond positions and velocities.
#[derive(Clone, Debug)]
pub(crate) enum Scheme {
    /// Semi-implicit Euler and the paper's explicit form: none.
    Explicit,
    /// Velocities of half steps.
    Verlet(Staggered),
    /// The state one step ago, and the vectors of the solve.
    Bdf2(Box<Bdf2>),
    /// Multipliers of the springs.
    Xpbd(SpringProjection),
}

impl Scheme {
    pub(crate) fn new(integrator: Integrator, network: &SpringNetwork) -> Self {
        match integrator {
            Integrator::SemiImplicit | Integrator::PaperExplicit => Self::Explicit,
            Integrator::Verlet => Self::Verlet(Staggered::new(network.node_count())),
            Integrator::Bdf2 => Self::Bdf2(Box::new(Bdf2::new(network))),
            Integrator::Xpbd => Self::Xpbd(SpringProjection::new(network)),
        }
    }

    /// Drops what was kept; `h` is the sub-step from now on, nodes of `mobility` 0 may not move.
    pub(crate) fn restart(&mut self, network: &SpringNetwork, mobility_m_per_n: &[f64], h: f64) {
        match self {
            Self::Explicit | Self::Xpbd(_) => {}
            Self::Verlet(staggered) => staggered.restart(network, mobility_m_per_n, h),
            Self::Bdf2(bdf2) => bdf2.restart(mobility_m_per_n),
        }
    }

    /// Drops differences over time, after positions were changed from outside.
    pub(crate) fn forget(&mut self) {
        if let Self::Bdf2(bdf2) = self {
            bdf2.forget();
        }
    }
}
