// A run on the terminal while it goes on.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "report/remaining_time.h"
#include "sweep/plan.h"
#include "sweep/records.h"

namespace sinerig::report {

class Progress {
 public:
  enum class Style {
    live,   // a picture that is drawn anew: how far, how long, the Bode plot, the last points
    lines,  // a line per finished point, for pipes and logs
    none,
  };

  struct Screen {
    std::size_t columns = 80;
    std::size_t rows = 24;
    bool colour = true;
  };

  // `screen` is asked before every picture and point, since windows change their size. Where one
  // has no room on it, 80 columns and 14 rows, there are lines from then on.
  Progress(std::ostream& stream, Style style, const SweepPlan& plan,
           std::function<Screen()> screen);

  // Points of before an interruption: counted and drawn, not listed again.
  void resume(const std::vector<Point>& points);

  // A finished point; those of the first response are shown.
  void point(const Point& point);

  // Where the loop is. Draws; at most ten times a second does a picture change.
  void update(std::uint32_t dwell, std::uint64_t tick);

  // Takes the picture away: what follows is the table of the run.
  void close();

 private:
  void look_at_screen();
  void draw();
  const char* paint(const char* code) const;
  std::string bar(std::size_t width) const;
  std::vector<std::string> picture() const;
  std::vector<std::string> plot(std::size_t width) const;

  std::ostream& stream_;
  Style style_;
  SweepPlan plan_;
  std::function<Screen()> ask_screen_;
  Screen screen_;
  RemainingTime time_;
  std::uint32_t dwell_ = 0;
  std::vector<Point> points_;
  std::size_t seen_ = 0;
  std::size_t not_good_ = 0;
  std::size_t drawn_lines_ = 0;
  std::chrono::steady_clock::time_point next_{};
};

}  // namespace sinerig::report
