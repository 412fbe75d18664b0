#include <stdexcept>

#include "report/raster.h"

namespace sinerig::report {

bool has_raster() noexcept {
  return false;
}

std::string png_from_svg(const std::string& /*svg*/, double /*scale*/) {
  throw std::runtime_error(
      "this build cannot draw PNG: librsvg was missing when it was built; install librsvg2-dev and "
      "build again, or take --format svg");
}

}  // namespace sinerig::report
