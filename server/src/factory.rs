//! The modules of `tmcl sim`: made when it starts, and made anew by `restart`, with what their EEPROMs keep.

use hal_sim::world::config::WorldConfig;
use tmcm_sim::fleet::{Fleet, Member};
use tmcm_sim::{Model, VirtualModule};

use crate::eeprom::EepromFile;
use crate::failure::Failure;

/// Makes modules of members.
type Make<'a, M> = dyn Fn(&[Member<'_>]) -> Result<Fleet<M>, Failure> + 'a;

/// Makes modules, always the same ones.
pub(crate) struct Factory<'a, M> {
    /// The model of each module, and the world around it.
    pub(crate) members: Vec<(Model, WorldConfig)>,
    /// Makes modules of these members, for each call new ones.
    pub(crate) make: Box<Make<'a, M>>,
}

impl<M: VirtualModule> Factory<'_, M> {
    /// The first modules. Their EEPROMs are kept in files, if there are any: as many as modules.
    pub(crate) fn first(&self, eeproms: Vec<EepromFile>) -> Result<Fleet<M>, Failure> {
        let contents: Vec<Option<&[u8]>> = eeproms.iter().map(EepromFile::contents).collect();
        let mut fleet = self.fleet(&contents)?;
        for (mut file, module) in eeproms.into_iter().zip(fleet.modules_mut()) {
            let mut board = module.board_mut();
            // The file is written at once, because a user should learn now, not at the first store, that it cannot be.
            file.save(board.at25().contents())?;
            board.at25_mut().keep_in(Box::new(file));
        }
        Ok(fleet)
    }

    /// New modules in the place of old ones, with the contents of their EEPROMs, which are kept where they were.
    pub(crate) fn anew(&self, old: &mut Fleet<M>) -> Result<Fleet<M>, Failure> {
        let contents: Vec<Vec<u8>> =
            old.modules_mut().iter_mut().map(|module| module.board_mut().at25().contents().to_vec()).collect();
        let contents: Vec<Option<&[u8]>> = contents.iter().map(|bytes| Some(bytes.as_slice())).collect();
        let mut fleet = self.fleet(&contents)?;
        for (old, module) in old.modules_mut().iter_mut().zip(fleet.modules_mut()) {
            if let Some(mut place) = old.board_mut().at25_mut().take_backing() {
                let mut board = module.board_mut();
                // A place that does not take what the start has stored has said so, and will be asked again.
                place.keep(board.at25().contents());
                board.at25_mut().keep_in(place);
            }
        }
        Ok(fleet)
    }

    /// Modules with these contents of their EEPROMs; those for which there are none have fresh ones.
    fn fleet(&self, eeproms: &[Option<&[u8]>]) -> Result<Fleet<M>, Failure> {
        let contents = eeproms.iter().copied().chain(std::iter::repeat(None));
        let members: Vec<Member<'_>> = (self.members.iter().zip(contents))
            .map(|((model, world), eeprom)| Member { model: *model, world, eeprom })
            .collect();
        let mut fleet = (self.make)(&members)?;
        fleet.await_silences();
        Ok(fleet)
    }
}
