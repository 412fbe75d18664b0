// Composes what the loop asks for with what identification knows: the modes of a probe's record.
#pragma once

#include "sweep/known_modes.h"

namespace sinerig::cli {

class IdentifiedModes final : public ModeFinder {
 public:
  bool find(const ProbeRecord& record, KnownModes& found) noexcept override;
};

}  // namespace sinerig::cli
