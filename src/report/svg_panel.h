// One plot of a picture: a frame over log frequency with its grid, curves, bands and marks.
#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "report/axis.h"

namespace sinerig::report {

struct SvgStyle {
  std::string stroke;
  double width = 1.0;
};

class SvgPanel {
 public:
  struct Place {
    double top = 0.0;
    double bottom = 0.0;
  };
  struct Scale {
    bool logarithmic = false;
    bool angle = false;       // ticks at 15, 30, 45, 90 …
    double least_span = 0.0;  // of a linear axis: what differs by less is the same
  };

  // `x` in Hz. The stream must outlive the panel.
  SvgPanel(std::ostream& stream, const Axis& x, Place place, std::string title);

  // Fits the value axis to the values, then draws grid, ticks and labels; call it first. What is
  // not finite, or not above zero on a logarithmic axis, is left out here and below.
  void range(const std::vector<double>& values, Scale scale);

  void line(const std::vector<double>& x, const std::vector<double>& y, const SvgStyle& style);
  void band(const std::vector<double>& x, const std::vector<double>& low,
            const std::vector<double>& high, const SvgStyle& style);
  // Filled circles for good points, open squares for all others.
  void marks(const std::vector<double>& x, const std::vector<double>& y,
             const std::vector<std::string>& status, const SvgStyle& style);

 private:
  bool drawable(double value) const;
  double pixel(double value) const;  // kept near the frame, so that nothing is drawn far outside
  void grid(const Ticks& vertical, const Ticks& horizontal, double step);

  std::ostream& stream_;
  Axis x_;
  Axis y_;
  std::string title_;
};

}  // namespace sinerig::report
