// SVG to PNG, where the build has librsvg.
#pragma once

#include <string>

namespace sinerig::report {

// False where librsvg was missing when this program was built.
bool has_raster() noexcept;

// The picture as PNG bytes, `scale` pixels per unit. Throws std::runtime_error: without librsvg,
// or with its message.
std::string png_from_svg(const std::string& svg, double scale);

}  // namespace sinerig::report
