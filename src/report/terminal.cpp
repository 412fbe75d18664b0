#include "report/terminal.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <ostream>
#include <utility>

#include "record/text.h"
#include "report/run_parts.h"
#include "report/run_summary.h"
#include "sweep/asked_frequencies.h"

namespace sinerig::report {

namespace {

using record::text;

constexpr double degrees_per_radian = 180.0 / std::numbers::pi;

double seconds_of(std::uint64_t samples, double rate_hz) {
  return static_cast<double>(samples) / rate_hz;
}

// Where the law that sets the amplitude changes: A, then V/ω, then Acc/ω².
std::string break_points(const SweepSettings& sweep) {
  if (!sweep.amplitude_table.empty()) return {};
  constexpr double two_pi = 2.0 * std::numbers::pi;
  std::string lines;
  const double to_velocity = sweep.follow_velocity / sweep.amplitude / two_pi;
  const double to_acceleration = sweep.follow_acceleration / sweep.follow_velocity / two_pi;
  const double straight_to_acceleration =
      std::sqrt(sweep.follow_acceleration / sweep.amplitude) / two_pi;
  if (std::isfinite(to_velocity) && !(to_acceleration < to_velocity)) {
    lines += text("the amplitude follows the velocity above %.4g Hz\n", to_velocity);
    if (std::isfinite(to_acceleration)) {
      lines += text("the amplitude follows the acceleration above %.4g Hz\n", to_acceleration);
    }
  } else if (std::isfinite(straight_to_acceleration)) {
    lines +=
        text("the amplitude follows the acceleration above %.4g Hz\n", straight_to_acceleration);
  }
  return lines;
}

std::string lengths(const Dwell& dwell, double rate_hz) {
  return text(" %9.3f %7u %9.4f %10.3f %10.3f", seconds_of(dwell.settle_samples, rate_hz),
              dwell.blocks, seconds_of(dwell.block_samples, rate_hz),
              seconds_of(dwell.min_samples(), rate_hz), seconds_of(dwell.max_samples, rate_hz));
}

}  // namespace

std::string usage_text(const ThreadUsage& usage) {
  const std::uint64_t faults = usage.minor_faults + usage.major_faults;
  const std::uint64_t switches = usage.involuntary_switches;
  std::string words = std::to_string(faults) + (faults == 1 ? " page fault" : " page faults");
  if (usage.major_faults > 0) words += " (" + std::to_string(usage.major_faults) + " from a disk)";
  return words + ", " + std::to_string(switches) +
         (switches == 1 ? " involuntary switch" : " involuntary switches");
}

std::string duration_text(double seconds) {
  const auto whole = static_cast<long>(std::llround(seconds));
  if (whole < 3600) return text("%ld:%02ld", whole / 60, whole % 60);
  return text("%ld:%02ld:%02ld", whole / 3600, whole / 60 % 60, whole % 60);
}

std::size_t point_count(const SweepPlan& plan) {
  std::size_t points = 0;
  for (const Dwell& dwell : plan.dwells) points += dwell.tones.size();
  return points;
}

std::string plan_size_text(const SweepPlan& plan) {
  const std::size_t points = point_count(plan);
  const std::string size = text("%zu points", points);
  return points == plan.dwells.size() ? size : size + text(" in %zu dwells", plan.dwells.size());
}

std::string bench_time_text(const SweepPlan& plan) {
  const std::string least = duration_text(plan.min_seconds());
  if (plan.min_samples() == plan.max_samples())
    return least + text(" (%.1f s)", plan.min_seconds());
  return least + " to " + duration_text(plan.max_seconds()) +
         text(" (%.1f to %.1f s)", plan.min_seconds(), plan.max_seconds());
}

namespace {

// The sweeps that the plan consists of, where there are several.
std::string sub_bands_text(const SweepPlan& plan) {
  std::string lines;
  std::size_t points = 0;
  for (std::size_t first = 0; first < plan.dwells.size();) {
    std::size_t end = first;
    const std::size_t first_point = points + 1;
    double low_hz = unlimited;
    double high_hz = 0.0;
    SweepPlan part{.rate_hz = plan.rate_hz, .dwells = {}};
    for (; end < plan.dwells.size() && plan.dwells[end].sub_band == plan.dwells[first].sub_band;
         ++end) {
      const Dwell& dwell = plan.dwells[end];
      for (const Tone& tone : dwell.tones) {
        low_hz = std::min(low_hz, dwell.tone_hz(tone, plan.rate_hz));
        high_hz = std::max(high_hz, dwell.tone_hz(tone, plan.rate_hz));
      }
      points += dwell.tones.size();
      part.dwells.push_back(dwell);
    }
    lines += text("sub-band %u: points %zu to %zu, %.6g to %.6g Hz, %s\n",
                  plan.dwells[first].sub_band + 1, first_point, points, low_hz, high_hz,
                  bench_time_text(part).c_str());
    first = end;
  }
  const bool several = !plan.dwells.empty() && plan.dwells.back().sub_band > 0;
  return several ? lines : "";
}

}  // namespace

void print_plan(std::ostream& stream, const SweepPlan& plan, const SweepSettings& sweep,
                const std::string& unit) {
  stream << text("amplitude in %s, velocity in %s/s, acceleration in %s/s²\n", unit.c_str(),
                 unit.c_str(), unit.c_str());
  stream << text("%5s %12s %14s %11s %11s %12s %9s %7s %9s %10s %10s\n", "point", "asked Hz",
                 "exact Hz", "amplitude", "velocity", "acceleration", "settle s", "blocks",
                 "block s", "at least s", "at most s");
  std::size_t points = 0;
  for (const Dwell& dwell : plan.dwells) {
    for (const Tone& tone : dwell.tones) {
      const bool first = &tone == &dwell.tones.front();
      const double frequency_hz = dwell.tone_hz(tone, plan.rate_hz);
      const double omega_rad_s = 2.0 * std::numbers::pi * frequency_hz;
      stream << text("%5zu %12s %14.9g %11.4g %11.4g %12.4g", ++points,
                     first ? text("%.6g", dwell.asked_hz).c_str() : "with it", frequency_hz,
                     tone.amplitude, tone.amplitude * omega_rad_s,
                     tone.amplitude * omega_rad_s * omega_rad_s);
      if (first) stream << lengths(dwell, plan.rate_hz);
      stream << '\n';
    }
  }
  stream << break_points(sweep);
  stream << sub_bands_text(plan);
  const std::size_t asked = asked_frequencies(sweep).size();
  if (asked > points) {
    stream << asked - points << " of " << asked
           << " points fell on a frequency already planned and were merged\n";
  }
  stream << plan_size_text(plan) << ", " << bench_time_text(plan) << " of bench time\n";
}

namespace {

// What the loop's thread had of the real-time rights that it asked for.
void print_rights(std::ostream& stream, const record::StoredRun& run) {
  const std::string prefix = "realtime_";
  const std::string mark = "missing: ";
  std::string missing;
  bool asked = false;
  for (const auto& [key, value] : run.facts) {
    if (!key.starts_with(prefix)) continue;
    asked = true;
    if (value.starts_with(mark))
      missing += (missing.empty() ? "" : ", ") + key.substr(prefix.size());
  }
  if (!asked) return;
  if (missing.empty())
    stream << "rights   " << run.fact("realtime_scheduling") << ", and all others asked for\n";
  else
    stream << "rights   without " << missing << '\n';
}

// Which run it is and how it went.
void print_head(std::ostream& stream, const record::StoredRun& run) {
  if (!run.fact("imported_from").empty()) {
    stream << "imported from " << run.fact("imported_from") << '\n';
    return;
  }
  stream << text("rig      %s, %g Hz, %s clock\n", run.fact("rig_name").c_str(), run.plan.rate_hz,
                 run.fact("clock").c_str());
  stream << text("run      %s on %s, sinerig %s\n", run.fact("started_utc").c_str(),
                 run.fact("host").c_str(), run.fact("sinerig").c_str());
  stream << "outcome  " << outcome_text(run) << '\n';
  std::uint64_t ticks = 0;
  std::uint64_t skipped = 0;
  std::int64_t max_lateness_ns = 0;
  for (const record::StoredTiming& timing : run.timings) {
    ticks += timing.ticks;
    skipped += timing.skipped;
    max_lateness_ns = std::max(max_lateness_ns, timing.max_lateness_ns);
  }
  stream << text("loop     %llu ticks, %llu skipped, %.1f µs late at most",
                 static_cast<unsigned long long>(ticks), static_cast<unsigned long long>(skipped),
                 static_cast<double>(max_lateness_ns) * 1e-3);
  if (const auto usage = run.usage()) stream << ", " << usage_text(*usage);
  stream << '\n';
  print_rights(stream, run);
  const std::string disk = disk_text(run);
  if (!disk.empty()) stream << "disk     " << disk << '\n';
  const std::vector<std::string> parts = part_texts(run);
  for (std::size_t i = 0; i < parts.size(); ++i)
    stream << text("part %-3zu ", i + 1) << parts[i] << '\n';
}

}  // namespace

bool any_modelled(const record::StoredResponse& response) {
  return std::any_of(response.points.begin(), response.points.end(), [](const auto& point) {
    return point.settled_by == to_string(SettledBy::model) ||
           point.settled_by == to_string(SettledBy::fallback) ||
           point.settled_by == to_string(SettledBy::both);
  });
}

void print_run(std::ostream& stream, const record::StoredRun& run) {
  print_head(stream, run);
  for (const record::StoredResponse& response : run.responses) {
    const record::ChannelInfo& input = run.channels.at(response.input);
    const record::ChannelInfo& output = run.channels.at(response.output);
    stream << text("\n%s / %s   (%s per %s)\n", output.name.c_str(), input.name.c_str(),
                   output.unit.c_str(), input.unit.c_str());
    const bool modelled = any_modelled(response);
    stream << text("%12s %10s %8s %10s %8s %10s %7s %9s %7s %8s  %s\n", "Hz", "gain dB", "± dB",
                   "phase °", "± °", "amplitude", "SNR dB", "coherence", "THD %", "seconds",
                   modelled ? "settled by  status" : "status");
    const std::vector<double> phase = record::unwrapped_phase(response.points);
    for (std::size_t i = 0; i < response.points.size(); ++i) {
      const record::StoredPoint& point = response.points[i];
      stream << text("%12.6f %10.4f %8.2g %10.3f %8.2g %10.4g %7.1f %9.6f %7.2f %8.2f  ",
                     point.frequency_hz, 20.0 * std::log10(std::abs(point.response)),
                     point.gain_interval_db, phase[i] * degrees_per_radian,
                     point.phase_interval_deg, point.input_amplitude, point.snr_db, point.coherence,
                     100.0 * point.distortion, point.seconds);
      if (modelled) stream << text("%-12s", point.settled_by.c_str());
      stream << point.status;
      if (!point.reason.empty())
        stream << text(": %s %.3g", point.reason.c_str(), point.reason_value);
      stream << '\n';
    }
  }
  bool first = true;
  for (const record::StoredEvent& event : run.events) {
    if (event.detail.empty()) continue;
    if (std::exchange(first, false)) stream << '\n';
    stream << event.kind << ": " << event.detail << '\n';
  }
}

}  // namespace sinerig::report
