// Composes what the loop asks for with what identification knows: the modes of a probe's record.
#pragma once

#include <string>
#include <vector>

#include "sweep/known_modes.h"

namespace sinerig::cli {

class IdentifiedModes final : public ModeFinder {
 public:
  bool find(const ProbeRecord& record, KnownModes& found) noexcept override;
};

// The modes of an earlier sweep of the same rig, from the fit that its file holds or from a new
// one: as far off as a night may move them. The noise from its points. `outputs`: names of the
// channels of the run's responses. Throws as read_plant_model does; record::SweepFileError where
// the file lacks one of the outputs.
KnownModes modes_of_file(const std::string& path, const std::vector<std::string>& outputs);

}  // namespace sinerig::cli
