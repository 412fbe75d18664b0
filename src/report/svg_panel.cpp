#include "report/svg_panel.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <ostream>
#include <utility>

#include "report/xml.h"

namespace sinerig::report {

namespace {

std::string at(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", value);
  return text;
}

}  // namespace

SvgPanel::SvgPanel(std::ostream& stream, const Axis& x, Place place, std::string title)
    : stream_{stream}, x_{x}, y_{.from = place.bottom, .to = place.top}, title_{std::move(title)} {}

bool SvgPanel::drawable(double value) const {
  return std::isfinite(value) && (!y_.logarithmic || value > 0.0);
}

double SvgPanel::pixel(double value) const {
  return std::clamp(y_(value), std::min(y_.from, y_.to), std::max(y_.from, y_.to));
}

void SvgPanel::range(const std::vector<double>& values, Scale scale) {
  y_.logarithmic = scale.logarithmic;
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const double value : values) {
    if (!drawable(value)) continue;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  if (low > high) {
    low = scale.logarithmic ? 1.0 : -1.0;
    high = scale.logarithmic ? 10.0 : 1.0;
  }
  if (scale.logarithmic) {
    const double margin = std::max(1.3, std::pow(high / low, 0.06));
    y_.low = low / margin;
    y_.high = high * margin;
  } else {
    // A value that is constant up to rounding has a span of a few ulp: no ticks fit in there.
    const double rounding = 1e-9 * std::max(std::abs(low), std::abs(high));
    const double margin =
        high > low ? std::max(0.07 * (high - low), rounding) : std::max(0.1 * std::abs(high), 1e-9);
    const double more = std::max(0.0, 0.5 * (scale.least_span - (high - low)) - margin);
    y_.low = low - margin - more;
    y_.high = high + margin + more;
  }
  const double rows = std::max(2.0, std::floor((y_.from - y_.to) / 32.0));
  const double step = scale.logarithmic ? 0.0
                      : scale.angle     ? angle_step(y_.high - y_.low, rows)
                                        : nice_step(y_.high - y_.low, rows);
  grid(log_ticks(x_.low, x_.high, (x_.to - x_.from) / 46.0),
       scale.logarithmic ? log_ticks(y_.low, y_.high, rows) : linear_ticks(y_.low, y_.high, step),
       step);
}

void SvgPanel::grid(const Ticks& vertical, const Ticks& horizontal, double step) {
  const auto lines = [&](const Ticks& ticks, bool upright, bool major) {
    stream_ << "<path fill=\"none\" stroke=\"" << (major ? "#e3e6e8" : "#f1f2f3") << "\" d=\"";
    for (const double value : major ? ticks.major : ticks.minor) {
      if (upright) {
        stream_ << 'M' << at(x_(value)) << ' ' << y_.to << 'V' << y_.from;
      } else {
        stream_ << 'M' << x_.from << ' ' << at(y_(value)) << 'H' << x_.to;
      }
    }
    stream_ << "\"/>";
  };
  for (const bool major : {false, true}) {
    lines(vertical, true, major);
    lines(horizontal, false, major);
  }
  stream_ << "<rect x=\"" << x_.from << "\" y=\"" << y_.to << "\" width=\"" << x_.to - x_.from
          << "\" height=\"" << y_.from - y_.to << "\" fill=\"none\" stroke=\"#b9bec3\"/>"
          << "<g fill=\"#5b636c\">";
  for (const double value : vertical.major) {
    if (x_(value) > x_.to - 30.0) continue;
    stream_ << "<text x=\"" << at(x_(value)) << "\" y=\"" << y_.from + 18
            << "\" text-anchor=\"middle\">" << tick_label(value, 0.0) << "</text>";
  }
  stream_ << "<text x=\"" << x_.to << "\" y=\"" << y_.from + 18
          << "\" text-anchor=\"end\">Hz</text>";
  for (const double value : horizontal.major) {
    stream_ << "<text x=\"" << x_.from - 9 << "\" y=\"" << at(y_(value) + 4.5)
            << "\" text-anchor=\"end\">" << tick_label(value, step) << "</text>";
  }
  stream_ << "</g><text x=\"" << x_.from << "\" y=\"" << y_.to - 9
          << "\" font-weight=\"600\" fill=\"#1b1f24\">" << xml_text(title_) << "</text>";
}

void SvgPanel::line(const std::vector<double>& x, const std::vector<double>& y,
                    const SvgStyle& style) {
  stream_ << "<path fill=\"none\" stroke=\"" << style.stroke << "\" stroke-width=\"" << style.width
          << "\" stroke-linejoin=\"round\" d=\"";
  bool pen_down = false;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (drawable(y[i])) stream_ << (pen_down ? 'L' : 'M') << at(x_(x[i])) << ' ' << at(pixel(y[i]));
    pen_down = drawable(y[i]);
  }
  stream_ << "\"/>";
}

void SvgPanel::band(const std::vector<double>& x, const std::vector<double>& low,
                    const std::vector<double>& high, const SvgStyle& style) {
  stream_ << "<path fill=\"" << style.stroke << "\" fill-opacity=\"0.17\" d=\"";
  for (std::size_t i = 0; i + 1 < x.size(); ++i) {
    if (!drawable(low[i] + high[i]) || !drawable(low[i + 1] + high[i + 1])) continue;
    stream_ << 'M' << at(x_(x[i])) << ' ' << at(pixel(low[i])) << 'L' << at(x_(x[i + 1])) << ' '
            << at(pixel(low[i + 1])) << 'V' << at(pixel(high[i + 1])) << 'L' << at(x_(x[i])) << ' '
            << at(pixel(high[i])) << 'Z';
  }
  stream_ << "\"/>";
}

void SvgPanel::marks(const std::vector<double>& x, const std::vector<double>& y,
                     const std::vector<std::string>& status, const SvgStyle& style) {
  const double radius = x.size() > 260 ? 1.3 : x.size() > 120 ? 1.8 : 2.4;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!drawable(y[i])) continue;
    if (status[i] == "good" || status[i] == "imported") {
      stream_ << "<circle cx=\"" << at(x_(x[i])) << "\" cy=\"" << at(pixel(y[i])) << "\" r=\""
              << radius << "\" fill=\"" << style.stroke << "\"/>";
    } else {
      stream_ << "<rect x=\"" << at(x_(x[i]) - 3.5) << "\" y=\"" << at(pixel(y[i]) - 3.5)
              << "\" width=\"7\" height=\"7\" fill=\"#ffffff\" stroke=\"#a85b00\" "
                 "stroke-width=\"1.6\"><title>"
              << xml_text(status[i]) << "</title></rect>";
    }
  }
}

}  // namespace sinerig::report
