#include "report/progress.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <ostream>
#include <utility>

#include "record/text.h"
#include "report/sparkline.h"
#include "report/terminal.h"

namespace sinerig::report {

namespace {

using record::text;

constexpr std::chrono::milliseconds draw_interval{100};
constexpr std::size_t least_columns = 80;
constexpr std::size_t most_columns = 110;
constexpr std::size_t least_rows = 14;  // a picture and the line below it where the cursor stands
constexpr std::size_t plot_rows = 6;
constexpr std::size_t label_width = 9;  // of the plot's axis
constexpr std::size_t points_shown = 5;

constexpr const char* bold = "\033[1m";
constexpr const char* soft = "\033[2m";
constexpr const char* green = "\033[32m";
constexpr const char* yellow = "\033[33m";
constexpr const char* blue = "\033[34m";
constexpr const char* plain = "\033[0m";

double gain_db(const Point& point) {
  return 20.0 * std::log10(std::abs(point.response));
}

std::string status_text(const Point& point) {
  const std::string reason = to_string(point.reason);
  const bool modelled = point.settled_by == SettledBy::model;
  return to_string(point.status) + (reason.empty() ? "" : ": " + reason) +
         (modelled ? ", transient modelled" : "");
}

std::string line_of(const Point& point, std::size_t number, std::size_t points) {
  constexpr double degrees_per_radian = 180.0 / std::numbers::pi;
  const auto half = [](const char* format, double value) {
    return std::isfinite(value) ? text(format, value) : std::string{" ±–      "};
  };
  // Points that refinement adds are none of the plan's.
  const std::string place = number > points ? text("%4zu+%zu", points, number - points)
                                            : text("%4zu/%zu", number, points);
  return place + text(" %10.4f Hz  %9.3f dB", point.frequency_hz, gain_db(point)) +
         half(" ±%-7.2g", point.gain_interval_db) +
         text("  %8.2f°", std::arg(point.response) * degrees_per_radian) +
         half(" ±%-7.2g", point.phase_interval_deg) + "  ";
}

}  // namespace

Progress::Progress(std::ostream& stream, Style style, const SweepPlan& plan,
                   std::function<Screen()> screen)
    : stream_{stream}, style_{style}, plan_{plan}, ask_screen_{std::move(screen)}, time_{plan} {
  look_at_screen();
}

void Progress::look_at_screen() {
  if (style_ != Style::live) return;
  screen_ = ask_screen_();
  const bool room = screen_.columns >= least_columns && screen_.rows >= least_rows;
  screen_.columns = std::min(screen_.columns, most_columns);
  if (room) return;
  close();
  style_ = Style::lines;
}

const char* Progress::paint(const char* code) const {
  return screen_.colour ? code : "";
}

void Progress::resume(const std::vector<Point>& points) {
  for (const Point& point : points) {
    if (point.pair != 0) continue;
    ++seen_;
    if (point.status != PointStatus::good) ++not_good_;
    if (style_ == Style::live) points_.push_back(point);
  }
}

void Progress::point(const Point& point) {
  if (point.pair != 0) return;
  ++seen_;
  if (point.status != PointStatus::good) ++not_good_;
  look_at_screen();
  if (style_ == Style::live) points_.push_back(point);
  if (style_ == Style::lines)
    stream_ << line_of(point, seen_, point_count(plan_)) << status_text(point) << std::endl;
}

void Progress::update(std::uint32_t dwell, std::uint64_t tick) {
  time_.update(dwell, tick);
  dwell_ = dwell;
  if (style_ != Style::live) return;
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) return;
  next_ = now + draw_interval;
  look_at_screen();
  if (style_ == Style::live) draw();
}

std::string Progress::bar(std::size_t width) const {
  static constexpr const char* eighths[] = {"", "▏", "▎", "▍", "▌", "▋", "▊", "▉"};
  const auto filled = static_cast<std::size_t>(time_.done() * static_cast<double>(8 * width));
  std::string drawn = paint(blue);
  for (std::size_t i = 0; i < filled / 8; ++i) drawn += "█";
  drawn += eighths[filled % 8];
  drawn += std::string{paint(plain)} + paint(soft);
  for (std::size_t i = (filled + 7) / 8; i < width; ++i) drawn += "░";
  return drawn + paint(plain);
}

// The gain over the whole range of the plan, filling up as points come in.
std::vector<std::string> Progress::plot(std::size_t width) const {
  std::vector<SparklinePoint> curve;
  double low = unlimited;
  double high = -unlimited;
  for (const Point& point : points_) {
    const double gain = gain_db(point);
    curve.push_back({std::log(point.frequency_hz), gain});
    if (!std::isfinite(gain)) continue;
    low = std::min(low, gain);
    high = std::max(high, gain);
  }
  if (!(low <= high)) low = high = 0.0;
  const double margin = std::max(0.5, 0.02 * (high - low));
  low -= margin;
  high += margin;
  std::sort(curve.begin(), curve.end(), [](const auto& a, const auto& b) { return a.x < b.x; });
  double first_hz = unlimited;
  double last_hz = 0.0;
  for (const Dwell& dwell : plan_.dwells) {
    for (const Tone& tone : dwell.tones) {
      first_hz = std::min(first_hz, dwell.tone_hz(tone, plan_.rate_hz));
      last_hz = std::max(last_hz, dwell.tone_hz(tone, plan_.rate_hz));
    }
  }
  std::vector<std::string> rows = sparkline(curve, width - label_width, plot_rows,
                                            std::log(first_hz), std::log(last_hz), low, high);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string label = i == 0                 ? text("%5.0f dB ", high)
                              : i + 1 == rows.size() ? text("%5.0f dB ", low)
                                                     : std::string(label_width - 1, ' ') + " ";
    rows[i] = paint(soft) + label + "│" + paint(plain) + paint(blue) + rows[i] + paint(plain);
  }
  const std::string from = text("%.4g", first_hz);
  const std::string to = text("%.4g Hz", last_hz);
  const std::size_t gap =
      width - label_width - std::min(width - label_width, from.size() + to.size());
  rows.push_back(std::string{paint(soft)} + std::string(label_width, ' ') + " " + from +
                 std::string(gap, ' ') + to + paint(plain));
  return rows;
}

std::vector<std::string> Progress::picture() const {
  const std::size_t planned = plan_.dwells.size();
  const bool refining = dwell_ >= planned && plan_.refinement.most_points > 0;
  const std::size_t number = std::min<std::size_t>(dwell_ + 1, planned);
  std::vector<std::string> lines;
  const std::string place =
      refining ? text("%zu+%zu  ", planned, dwell_ + 1 - planned) + paint(bold) + "refining" +
                     paint(plain)
               : text("%zu/%zu  ", number, planned) + paint(bold) +
                     text("%.4g Hz", plan_.dwells[number - 1].frequency_hz(plan_.rate_hz)) +
                     paint(plain);
  const std::string left =
      refining ? ""
               : ", " + (paint(bold) + duration_text(time_.remaining_s())) + paint(plain) + " left";
  const std::string times =
      place + "  " + duration_text(time_.elapsed_s()) + " elapsed" + left +
      (not_good_ == 0 ? "" : paint(yellow) + text(", %zu not good", not_good_) + paint(plain));
  lines.push_back(bar(screen_.columns - 66) + " " + times);
  for (std::string& row : plot(screen_.columns - 2)) lines.push_back(std::move(row));
  const std::size_t first = points_.size() - std::min(points_.size(), points_shown);
  for (std::size_t i = first; i < first + points_shown; ++i) {
    if (i >= points_.size()) {
      lines.emplace_back();
      continue;
    }
    const bool good = points_[i].status == PointStatus::good;
    lines.push_back(line_of(points_[i], i + 1, point_count(plan_)) +
                    (good ? paint(green) : paint(yellow)) + status_text(points_[i]) + paint(plain));
  }
  return lines;
}

void Progress::draw() {
  const std::vector<std::string> lines = picture();
  // Without wrapping: a line that is too long is cut, not broken.
  std::string frame = "\033[?7l";
  if (drawn_lines_ > 0) frame += text("\033[%zuA", drawn_lines_);
  for (const std::string& line : lines) frame += "\r" + line + "\033[K\n";
  stream_ << frame << "\033[?7h" << std::flush;
  drawn_lines_ = lines.size();
}

void Progress::close() {
  if (drawn_lines_ > 0) stream_ << text("\033[%zuA\r\033[J", drawn_lines_) << std::flush;
  drawn_lines_ = 0;
}

}  // namespace sinerig::report
