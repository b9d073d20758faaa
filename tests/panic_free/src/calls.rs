//! Calls of everything public, each with values the compiler cannot know: what comes out of [`any`] may be anything
//! that its type allows.

mod chips;
mod language;
mod module;
mod motion;
mod node;
mod stand_ins;
mod state;

use core::hint::black_box as any;

use stand_ins::Bare;
use tmcm::product::{TMCM_1140, TMCM_3212, TMCM_6110, Tmcm1140, Tmcm3212, Tmcm6110};
use tmcm::tmcl::Command;
use tmcm::units::{CurrentScale, Micros};

fn command() -> Command {
    any(Command::default())
}

fn now() -> Micros {
    any(Micros(0))
}

fn text() -> &'static [u8] {
    any(&[])
}

/// Everything. None of these is made part of another, so that what can panic has a name.
#[inline(never)]
pub(crate) fn all() {
    units();
    language::language();
    language::parameters();
    chips::chips();
    motion::motion();
    state::store();
    state::epochs();
    state::machine();
    module::port();
    module::module::<Tmcm1140, { TMCM_1140.axes as usize }>();
    module::module::<Tmcm6110, { TMCM_6110.axes as usize }>();
    module::module::<Tmcm3212, { TMCM_3212.axes as usize }>();
    module::device::<Tmcm1140, { TMCM_1140.axes as usize }>();
    module::device::<Tmcm6110, { TMCM_6110.axes as usize }>();
    module::device::<Tmcm3212, { TMCM_3212.axes as usize }>();
    node::node();
    #[cfg(feature = "deliberate")]
    any(text()[any(0)]);
}

#[inline(never)]
fn units() {
    any(Micros::from_millis(any(0)).after(now()).since(now()).millis());
    any(CurrentScale::from_parameter(any(0)).bits());
}
