// Two hours of sweep in virtual time, ended by force at random instants, resumed, and looked at:
//
//   tools/bench crash [--count N] [--seed S] [--mode kill|power|full]
//
// kill: the program killed with -9 at a random time. power: the same at a random operation of its
// disk, of which only what was synced is left. full: the disk full at a random size. Every third
// resume is ended by force, too. Nothing that was reported finished may be lost or changed, every
// file has to be sound and every run to be completed. Exit code 1 where one is not.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>
#include <sstream>
#include <stdexcept>

#include "crash/child.h"
#include "crash/sweep_rows.h"
#include "record/compare.h"
#include "record/sweep_reader.h"

namespace sinerig::test {
namespace {

namespace fs = std::filesystem;

enum class Mode { kill, power, full };
constexpr const char* names[] = {"kill", "power", "full"};

struct Options {
  int count = 200;
  std::uint64_t seed = 1;
  std::vector<Mode> modes{Mode::kill, Mode::power, Mode::full};
};

// What an undisturbed run does.
struct Reference {
  SweepRows rows;
  record::StoredRun run;
  double seconds = 0.0;
  std::uint64_t operations = 0;
  std::uint64_t bytes = 0;
};

struct Tally {
  int trials = 0;
  int not_begun = 0;  // ended before the plan was on the disk
  int over = 0;       // ended by itself before its time
  int twice = 0;      // the resume was ended by force, too
  std::uint64_t dwells_kept = 0;
  std::uint64_t told = 0;  // points reported as finished
  std::uint64_t lost = 0;
  std::uint64_t changed = 0;
  int unsound = 0;     // integrity_check
  int incomplete = 0;  // resumed, and not done
  int reasonless = 0;  // disk full: the file does not say so
  std::vector<std::string> failures;
};

class Trials {
 public:
  Trials(std::string folder, std::uint64_t seed) : folder_{std::move(folder)}, random_{seed} {
    fs::create_directories(folder_);
    fs::copy_file(CRASH_RIG, folder_ + "/two_hours.toml", fs::copy_options::overwrite_existing);
    refer();
  }
  ~Trials() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  Trials(const Trials&) = delete;
  Trials& operator=(const Trials&) = delete;

  const Reference& reference() const { return reference_; }
  Tally run(Mode mode, int count);

 private:
  std::string path() const { return folder_ + "/run.sweep"; }
  void refer();
  ChildEnd disturbed(Mode mode, const std::string& command);
  void trial(Mode mode, Tally& tally);
  void check_told(const ChildEnd& end, const SweepRows& rows, Tally& tally);
  void look_at(const SweepRows& before, std::uint32_t parts, Tally& tally);
  std::uint64_t up_to(std::uint64_t most) {
    return std::uniform_int_distribution<std::uint64_t>{1, most}(random_);
  }

  std::string folder_;
  std::mt19937_64 random_;
  Reference reference_;
};

std::vector<std::string> arguments(const std::string& command) {
  if (command == "run") {
    return {"run", "two_hours.toml", "-o", "run.sweep", "--force", "--json", "--no-report"};
  }
  return {"resume", "run.sweep", "--json", "--no-report"};
}

void Trials::refer() {
  const std::string count = folder_ + "/count";
  const ChildEnd end = run_child(FAULTY_SINERIG, arguments("run"), folder_, "count=" + count, {});
  if (end.code != 0) throw std::runtime_error("the undisturbed run failed: " + end.errors);
  std::ifstream{count} >> reference_.operations >> reference_.bytes;
  reference_.rows = rows_of(path());
  reference_.run = record::read_sweep(path());
  reference_.seconds = run_child(SINERIG_BINARY, arguments("run"), folder_, "", {}).seconds;
}

ChildEnd Trials::disturbed(Mode mode, const std::string& command) {
  if (mode == Mode::kill) {
    const std::chrono::microseconds at{up_to(static_cast<std::uint64_t>(1e6 * reference_.seconds))};
    return run_child(SINERIG_BINARY, arguments(command), folder_, "", at);
  }
  const std::string orders = mode == Mode::power
                                 ? "power,kill=" + std::to_string(up_to(reference_.operations))
                                 : "full=" + std::to_string(up_to(reference_.bytes));
  return run_child(FAULTY_SINERIG, arguments(command), folder_, orders, {});
}

std::string point_start(const ToldPoint& point) {
  return "point:" + std::to_string(point.dwell) + ",";
}

// A row is dwell,tone,response,input,output,freq_hz,re,im,…; --json rounds to nine digits.
bool holds(const std::set<std::string>& rows, const ToldPoint& point) {
  const std::string start = point_start(point);
  const auto near = [](double a, double b) {
    return std::abs(a - b) <= 2e-8 * std::max(std::abs(a), std::abs(b));
  };
  for (auto row = rows.lower_bound(start); row != rows.end() && row->rfind(start, 0) == 0; ++row) {
    std::istringstream fields{row->substr(6)};
    std::vector<double> values;
    for (std::string field; values.size() < 8 && std::getline(fields, field, ',');) {
      values.push_back(std::strtod(field.c_str(), nullptr));
    }
    const bool gyro = point.output == "gyro";
    if (values.size() == 8 && (values[4] == 3.0) == gyro && near(values[5], point.freq_hz) &&
        near(values[6], point.re) && near(values[7], point.im)) {
      return true;
    }
  }
  return false;
}

void Trials::check_told(const ChildEnd& end, const SweepRows& rows, Tally& tally) {
  for (const ToldPoint& point : end.points) {
    // A disk that fills up stops the run in the midst of a dwell, which is told of as stopped.
    if (point.dwell >= rows.finished && end.code == 3) continue;
    ++tally.told;
    if (holds(rows.points, point)) continue;
    ++tally.lost;
    tally.failures.push_back("lost: dwell " + std::to_string(point.dwell));
  }
}

void Trials::look_at(const SweepRows& before, std::uint32_t parts, Tally& tally) {
  const SweepRows after = rows_of(path());
  const SweepRows kept = rows_of(path(), before.finished);
  const auto fail = [&](const std::string& what) {
    tally.failures.push_back(what);
  };
  std::vector<std::string> missing;
  std::set_difference(before.rows.begin(), before.rows.end(), kept.rows.begin(), kept.rows.end(),
                      std::back_inserter(missing));
  tally.changed += missing.size();
  if (!missing.empty()) fail("changed: " + missing.front());
  if (after.integrity != "ok") {
    ++tally.unsound;
    fail("integrity: " + after.integrity);
  }
  const bool whole = after.outcome == "done" && after.finished == after.dwells &&
                     after.dwells >= 40 && after.stopped == 0 && after.parts == parts;
  if (!whole) {
    ++tally.incomplete;
    fail("incomplete: " + after.outcome + ", " + std::to_string(after.finished) + " of " +
         std::to_string(after.dwells) + " dwells, " + std::to_string(after.parts) + " parts of " +
         std::to_string(parts));
  }
}

void Trials::trial(Mode mode, Tally& tally) {
  ++tally.trials;
  for (const char* suffix : {"", "-wal", "-shm", "-spare", "-journal"}) fs::remove(path() + suffix);
  std::uint32_t parts = 1;
  ChildEnd end = disturbed(mode, "run");
  SweepRows before = rows_of(path());
  if (before.begun && before.parts == 0) parts = 0;  // the plan was there, no part had begun
  check_told(end, before, tally);
  const bool over = end.code == 0;
  if (over) ++tally.over;
  if (!before.begun) {
    ++tally.not_begun;
    return;
  }
  // In virtual time what is on the disk is what an undisturbed run has measured, to the last bit.
  if (!std::includes(reference_.rows.points.begin(), reference_.rows.points.end(),
                     before.points.begin(), before.points.end())) {
    tally.failures.push_back("not the points of an undisturbed run");
    ++tally.changed;
  }
  if (mode == Mode::full && !over && before.outcome != "stopped") {
    ++tally.reasonless;
    tally.failures.push_back("no reason in the file: " + end.errors);
  }
  if (!over && up_to(3) == 1) {
    ++tally.twice;
    end = disturbed(mode, "resume");
    const SweepRows then = rows_of(path());
    check_told(end, then, tally);
    if (!std::includes(then.rows.begin(), then.rows.end(), before.rows.begin(),
                       before.rows.end())) {
      ++tally.changed;
      tally.failures.push_back("changed by a resume that was ended by force");
    }
    if (then.integrity != "ok") ++tally.unsound;
    parts = then.parts;
    before = then;
  }
  tally.dwells_kept += before.finished;
  if (before.outcome != "done") ++parts;
  end = run_child(SINERIG_BINARY, arguments("resume"), folder_, "", {});
  if (end.code != 0) {
    tally.failures.push_back("resume: exit code " + std::to_string(end.code) + ": " + end.errors);
  }
  look_at(before, parts, tally);
}

Tally Trials::run(Mode mode, int count) {
  Tally tally;
  for (int i = 0; i < count; ++i) trial(mode, tally);
  return tally;
}

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; i += 2) {
    const std::string name = argv[i];
    const std::string value = i + 1 < argc ? argv[i + 1] : "";
    const auto* mode = std::find(std::begin(names), std::end(names), value);
    if (name == "--count" && !value.empty()) {
      options.count = std::stoi(value);
    } else if (name == "--seed" && !value.empty()) {
      options.seed = std::stoull(value);
    } else if (name == "--mode" && mode != std::end(names)) {
      options.modes = {static_cast<Mode>(mode - std::begin(names))};
    } else {
      throw std::invalid_argument("usage: crash [--count N] [--seed S] [--mode kill|power|full]");
    }
  }
  return options;
}

int run_all(const Options& options) {
  std::string folder = (fs::temp_directory_path() / "sinerig-crash-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) throw std::runtime_error("no temporary folder");
  Trials trials{folder, options.seed};
  const Reference& reference = trials.reference();
  double bench_s = 0.0;
  for (const record::StoredTiming& timing : reference.run.timings) {
    bench_s += static_cast<double>(timing.ticks) / reference.run.plan.rate_hz;
  }
  std::printf(
      "undisturbed: %.2f h of bench time, %u dwells, %zu points, %llu disk operations, "
      "%llu bytes, %.2f s; seed %llu\n\n",
      bench_s / 3600.0, reference.rows.finished, reference.rows.points.size(),
      static_cast<unsigned long long>(reference.operations),
      static_cast<unsigned long long>(reference.bytes), reference.seconds,
      static_cast<unsigned long long>(options.seed));
  std::printf("%-6s %7s %10s %5s %6s %11s %8s %5s %8s %8s %11s\n", "mode", "trials", "not begun",
              "over", "twice", "dwells kept", "reported", "lost", "changed", "unsound",
              "incomplete");
  bool failed = false;
  for (const Mode mode : options.modes) {
    const Tally tally = trials.run(mode, options.count);
    std::printf("%-6s %7d %10d %5d %6d %11llu %8llu %5llu %8llu %8d %11d\n",
                names[static_cast<int>(mode)], tally.trials, tally.not_begun, tally.over,
                tally.twice, static_cast<unsigned long long>(tally.dwells_kept),
                static_cast<unsigned long long>(tally.told),
                static_cast<unsigned long long>(tally.lost),
                static_cast<unsigned long long>(tally.changed), tally.unsound, tally.incomplete);
    std::fflush(stdout);
    for (const std::string& each : tally.failures) std::printf("  %s\n", each.c_str());
    failed = failed || !tally.failures.empty();
  }
  return failed ? 1 : 0;
}

}  // namespace
}  // namespace sinerig::test

int main(int argc, char** argv) {
  try {
    return sinerig::test::run_all(sinerig::test::parse(argc, argv));
  } catch (const std::exception& error) {
    std::cerr << "crash: " << error.what() << '\n';
    return 2;
  }
}
