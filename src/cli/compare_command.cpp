#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <stdexcept>

#include <nlohmann/json.hpp>
#include <spdlog/spdlog.h>

#include "cli/commands.h"
#include "cli/drift_figures.h"
#include "cli/measured_run.h"
#include "cli/output_file.h"
#include "cli/report_file.h"
#include "cli/run_differences.h"
#include "report/comparison.h"
#include "report/html.h"

namespace sinerig::cli {

namespace {

namespace fs = std::filesystem;
using record::Difference;

// Two files of one name in different folders are told apart by their paths.
std::string label_of(const std::string& file, const std::vector<std::string>& files) {
  std::string label = fs::path{file}.stem().string();
  for (const std::string& other : files)
    if (other != file && fs::path{other}.stem().string() == label) return file;
  return label;
}

}  // namespace

int compare_command(const CompareOptions& options) {
  refuse_input(options.output, options.files);
  if (!options.channel.empty() && !options.drift && !has_controller(options.loop))
    throw std::invalid_argument(
        "--channel chooses the sensor whose model --drift compares; the points of all are "
        "compared");
  std::vector<report::LabelledRun> runs;
  for (const std::string& file : options.files)
    runs.push_back({.label = label_of(file, options.files), .run = read_run(file)});
  std::vector<report::LabelledRun> as_planned;
  for (const report::LabelledRun& run : runs) as_planned.push_back(with_unmeasured(run));
  const std::vector<Difference> differences = differences_of(as_planned, options.settings);

  bool changed = false;
  for (const Difference& difference : differences) changed = changed || difference.changed();
  std::vector<std::string> labels;
  for (const report::LabelledRun& run : runs) labels.push_back(run.label);
  const std::vector<std::string> incomparable = report::files_without_points(labels, differences);
  if (incomparable.size() + 1 == runs.size() && !changed) {
    throw record::SweepFileError(
        "nothing to compare: the files have no frequency in common at which both points are good");
  }
  for (const std::string& label : incomparable)
    spdlog::warn("{}: nothing to compare, no frequency at which both points are good", label);
  std::vector<report::Drift> drifts;
  if (options.drift || has_controller(options.loop)) {
    drifts = drift_of(options.files, labels,
                      {.loop = options.loop,
                       .channel = options.channel,
                       .false_alarm = options.settings.false_alarm,
                       .tolerance = 0.01 * options.tolerance_percent});
  }
  for (const report::Drift& drift : drifts) changed = changed || drift.changed();

  if (options.voice == Voice::text) {
    report::print_comparison(std::cout, runs.front().label, differences);
    for (const report::Drift& drift : drifts)
      report::print_drift(std::cout, runs.front().label, drift);
  } else if (options.voice == Voice::json) {
    const nlohmann::ordered_json json =
        report::comparison_json(runs.front().label, differences, drifts);
    // A label is a file's name, of whatever bytes.
    std::cout << json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << '\n';
  }
  if (!options.output.empty()) {
    write_file(
        options.output, options.force || is_report(options.output),
        [&](std::ostream& stream) { report::write_html(stream, runs, differences, drifts); });
    spdlog::info("wrote {}", options.output);
  }
  if (changed) return exit_changed;
  return incomparable.empty() ? exit_done : exit_failed;
}

}  // namespace sinerig::cli
