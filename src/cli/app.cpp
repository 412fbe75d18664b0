#include "cli/app.h"

#include <CLI/CLI.hpp>
#include <spdlog/cfg/env.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "cli/commands.h"
#include "cli/fit_command.h"
#include "cli/fit_input.h"
#include "cli/margins_command.h"
#include "cli/notch_command.h"
#include "config/section.h"
#include "record/database.h"
#include "version.h"

namespace sinerig::cli {

namespace {

constexpr const char* description =
    "Measures the frequency response of a gimbal, servo or actuator with stepped sines, in real\n"
    "time, over the bus it already has; or of a simulated plant, in no time.\n"
    "\n"
    "  sinerig plan config/gimbal.toml     what would be run, and for how long; nothing moves\n"
    "  sinerig check config/gimbal.toml    reads every channel for a while; nothing moves\n"
    "  sinerig run config/gimbal.toml      run it; leaves gimbal.sweep and gimbal.html\n"
    "  sinerig show gimbal.sweep           the points of a run\n"
    "  sinerig report gimbal.sweep         the report again, or as a picture with --format svg\n"
    "  sinerig export gimbal.sweep --format mat -o gimbal.mat\n"
    "  sinerig fit gimbal.sweep            a transfer function with delay and error bars\n"
    "  sinerig margins gimbal.sweep --pid 3,3,0.15,10\n"
    "  sinerig notch gimbal.sweep --pid 3,3,0.15,10\n"
    "  sinerig compare monday.sweep today.sweep";

constexpr const char* footer =
    "Exit codes: 0 done, 1 failed, 2 usage or configuration, 3 stopped by a limit or a fault,\n"
    "4 interrupted, 5 compare found a change. Every key of a rig file is explained in the files of "
    "config/.";

constexpr const char* measured_file =
    "sweep file, or a response measured elsewhere: .csv, .txt, .mat, .uff or .unv";

CLI::App* add_fit(CLI::App& app, FitCommandOptions& options) {
  CLI::App* fit = app.add_subcommand(
      "fit",
      "Identify a transfer function with delay from sweep files or CSV (freq_hz,re,im[,std])");
  fit->add_option("FILE", options.files, "sweep or CSV files; several are fitted jointly")
      ->required();
  fit->add_option("--method", options.method,
                  "ml: maximum likelihood; hassul, choe: the methods of the papers")
      ->check(CLI::IsMember({"ml", "hassul", "choe"}))
      ->capture_default_str();
  fit->add_option("--zeros", options.zeros, "zeros, those at the origin included");
  fit->add_option("--poles", options.poles, "poles, those at the origin included");
  fit->add_option("--origin", options.origin, "poles at the origin; negative: zeros there");
  fit->add_option("--order", options.order,
                  "auto: choose the parts of the order that are not given (default without them)")
      ->check(CLI::IsMember({"auto"}));
  fit->add_option("--delay", options.delay, "none, fit, or a known delay in seconds")
      ->capture_default_str();
  fit->add_option("--hold", options.hold,
                  "zero-order hold that drove the plant: auto (the loop of a sweep file), none, or "
                  "its rate in Hz")
      ->capture_default_str();
  fit->add_option("--path-delay", options.path_delay_s,
                  "delay of the measuring path in seconds, not part of the model");
  fit->add_option("--static-gain", options.static_gain, "known gain of s^origin G(s) at s = 0");
  fit->add_option("--given-pole", options.given_poles_rad_s, "a known real pole in rad/s");
  fit->add_option("--model-error", options.model_error,
                  "relative error of the model itself, added to the scatter (default: 0 for CSV, "
                  "0.002 for sweep files)");
  fit->add_option("--weights", options.weights, "hassul: none, 1/w, or W1,W2,... one per point")
      ->capture_default_str();
  fit->add_option("--bands", options.bands, "choe: number of sub-bands")->capture_default_str();
  fit->add_flag("--stable", options.stable, "keep poles in the left half plane");
  fit->add_flag("--minimum-phase", options.minimum_phase, "keep zeros in the left half plane");
  fit->add_flag("--keep-outliers", options.keep_outliers, "never leave a point out");
  fit->add_option("--channel", options.channel, "sensor of a sweep file (default: the first)");
  fit->add_flag("--json", options.json, "print one JSON object");
  fit->add_flag("--no-store", options.no_store, "do not store the fit in the sweep file");
  return fit;
}

void add_loop_options(CLI::App& command, LoopOptions& options) {
  command
      .add_option("--controller-num", options.controller_num,
                  "controller's numerator, descending powers of s: C1,C2,...")
      ->delimiter(',');
  command.add_option("--controller-den", options.controller_den, "its denominator")->delimiter(',');
  command
      .add_option("--pid", options.pid,
                  "controller KP,KI,KD[,FILTER_HZ]: KP + KI/s + KD s/(1 + s/(2 pi FILTER_HZ))")
      ->delimiter(',');
  command.add_option("--rate", options.rate_hz,
                     "rate in Hz that the controller runs at, by Tustin behind a zero-order hold; "
                     "0: continuous (default: the loop rate of a sweep file)");
  command.add_option("--loop-delay", options.delay_s,
                     "more delay in the loop, seconds: calculation, transport");
}

CLI::App* add_margins(CLI::App& app, MarginsOptions& options) {
  CLI::App* margins = app.add_subcommand(
      "margins", "Gain, phase and delay margin, crossover, Ms, bandwidth and resonances of a loop");
  margins->add_option("FILE", options.file, "sweep file or CSV")->required();
  margins
      ->add_option("--response", options.response,
                   "what the file is the response of: plant, loop L = PC, sensitivity 1/(1+L) or "
                   "complementary L/(1+L)")
      ->check(CLI::IsMember({"plant", "loop", "sensitivity", "complementary"}))
      ->capture_default_str();
  add_loop_options(*margins, options.loop);
  margins->add_option("--controller-file", options.loop.controller_file,
                      "measured response of the controller, sweep file or CSV");
  margins->add_option("--channel", options.channel, "sensor of a sweep file (default: the first)");
  margins->add_flag("--points-only", options.points_only, "leave the model out");
  margins->add_flag("--refit", options.refit, "fit anew even if the sweep file holds a fit");
  margins->add_flag("--json", options.json, "print one JSON object");
  return margins;
}

CLI::App* add_notch(CLI::App& app, NotchOptions& options) {
  CLI::App* notch = app.add_subcommand(
      "notch", "Design notch filters that hold over the uncertainty and drift of the resonances");
  notch
      ->add_option("FILE", options.files,
                   "sweep files or CSV; the first is the plant, all show how far it drifts")
      ->required();
  notch
      ->add_option("--at", options.at_hz,
                   "resonances to notch, Hz, by commas (default: the lowest)")
      ->delimiter(',');
  notch->add_option("--attenuation", options.attenuation_db,
                    "wanted at the resonance wherever it lies, dB (default: what brings its peak "
                    "in the loop to -12 dB, 6 at least; 20 without a controller)");
  notch->add_option("--crossover", options.crossover_hz,
                    "frequency where phase is to be saved, Hz (default: the gain crossover; a "
                    "quarter of the resonance without a controller)");
  notch
      ->add_option("--within", options.within_hz,
                   "more drift to allow for, Hz to each side of the resonance")
      ->check(CLI::NonNegativeNumber);
  notch->add_option("--fixed", options.fixed, "INTEGER.FRACTION bits of the fixed-point form")
      ->capture_default_str();
  notch->add_option("--format", options.format, "text, c or json")
      ->check(CLI::IsMember({"text", "c", "json"}))
      ->capture_default_str();
  notch->add_flag_callback(
      "--json", [&options] { options.format = "json"; }, "same as --format json");
  add_loop_options(*notch, options.loop);
  notch->add_option("--channel", options.channel, "sensor of a sweep file (default: the first)");
  notch->add_flag("--refit", options.refit, "fit anew even if the sweep file holds a fit");
  return notch;
}

void set_up_logging(const std::string& level) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("sinerig"));
  spdlog::set_pattern("%^%l%$: %v");
  spdlog::cfg::load_env_levels();
  if (!level.empty()) spdlog::set_level(spdlog::level::from_str(level));
}

}  // namespace

int run_app(int argc, char** argv, const std::vector<DriverKit>& drivers) {
  CLI::App app{description, "sinerig"};
  app.footer(footer);
  app.set_version_flag("--version", std::string{"sinerig "} + version);
  app.require_subcommand(1);
  app.fallthrough();
  std::string log_level;
  app.add_option("--log-level", log_level,
                 "trace, debug, info, warn, error or off (also: SPDLOG_LEVEL)")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}));

  std::string rig;
  std::string file;
  RunOptions run_options;
  ExportOptions export_options;
  ReportOptions report_options;

  CLI::App* plan = app.add_subcommand(
      "plan", "Print every dwell of a rig file and the total duration; refuse what can't be run");
  plan->add_option("RIG", rig, "rig file (TOML)")->required();

  double check_seconds = 3.0;
  CLI::App* check = app.add_subcommand(
      "check",
      "Open a rig and read every channel without moving anything: rate, age, jitter, losses, and "
      "what would stop a sweep");
  check->add_option("RIG", rig, "rig file (TOML)")->required();
  check->add_option("--seconds", check_seconds, "how long")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();

  CLI::App* run = app.add_subcommand("run", "Run the sweep of a rig file and write a sweep file");
  run->add_option("RIG", run_options.rig, "rig file (TOML)")->required();
  run->add_option(
      "-o,--output", run_options.output,
      "sweep file to write (default: RIG's name + .sweep, here; numbered when it exists)");
  run->add_flag("--force", run_options.force, "replace the sweep file if it exists");
  bool no_report = false;
  run->add_flag("--no-report", no_report, "do not write the report NAME.html at the end");

  CLI::App* show =
      app.add_subcommand("show", "Print a sweep file: how the run went and its points");
  show->add_option("FILE", file, measured_file)->required();

  CLI::App* exporter = app.add_subcommand(
      "export", "Write responses for other programs: CSV, JSON, MATLAB, UFF 58, source text");
  exporter->add_option("FILE", export_options.file, measured_file)->required();
  exporter
      ->add_option("--format", export_options.format,
                   "csv; json; mat: MATLAB 5, the fields of frd and idfrd; uff: dataset 58; "
                   "snippet: Python source, or MATLAB's with -o NAME.m")
      ->check(CLI::IsMember({"csv", "json", "mat", "uff", "snippet"}))
      ->capture_default_str();
  exporter->add_option("-o,--output", export_options.output,
                       "file to write (default: standard output)");
  exporter->add_option(
      "--channel", export_options.channel,
      "sensor whose response is written (default: the first; all in json, mat and uff)");
  exporter->add_flag("--force", export_options.force, "replace the file if it exists");

  CLI::App* reporter = app.add_subcommand(
      "report", "Write a sweep file's report: one HTML page for any browser, or a picture");
  reporter->add_option("FILE", report_options.file, measured_file)->required();
  reporter
      ->add_option("--format", report_options.format,
                   "html: the interactive page; svg or png: the Bode plot of one response")
      ->check(CLI::IsMember({"html", "svg", "png"}))
      ->capture_default_str();
  reporter->add_option("-o,--output", report_options.output,
                       "file to write (default: FILE's name with the format's extension)");
  reporter->add_option("--channel", report_options.channel,
                       "sensor that the picture shows (default: the first)");
  reporter->add_flag("--force", report_options.force,
                     "replace the file if it exists (a report is replaced anyway)");

  FitCommandOptions fit_options;
  CLI::App* fit = add_fit(app, fit_options);
  MarginsOptions margins_options;
  CLI::App* margins = add_margins(app, margins_options);
  NotchOptions notch_options;
  CLI::App* notch = add_notch(app, notch_options);
  CompareOptions compare_options;
  CLI::App* comparer = app.add_subcommand(
      "compare", "Tell whether measurements differ by more than their scatter explains");
  comparer->add_option("FILES", compare_options.files, "files; the first is the reference")
      ->required()
      ->expected(2, -1);
  comparer
      ->add_option("--tolerance-db", compare_options.settings.tolerance_db,
                   "changes of the gain up to this are none, dB")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  comparer
      ->add_option("--tolerance-deg", compare_options.settings.tolerance_deg,
                   "changes of the phase up to this are none, degrees")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  comparer
      ->add_option("--false-alarm", compare_options.settings.false_alarm,
                   "chance to call two equal responses different")
      ->check(CLI::Range(1e-12, 0.5))
      ->capture_default_str();
  comparer->add_option("-o,--output", compare_options.output,
                       "page that lays them over each other");
  comparer->add_flag("--force", compare_options.force, "replace the page if it exists");

  CLI::App* list = app.add_subcommand("drivers", "List the drivers of this build");

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? exit_done : exit_usage;
  }
  set_up_logging(log_level);
  run_options.report = !no_report;

  try {
    if (plan->parsed()) return plan_command(rig, drivers);
    if (check->parsed()) return check_command(rig, check_seconds, drivers);
    if (run->parsed()) return run_command(run_options, drivers);
    if (show->parsed()) return show_command(file);
    if (exporter->parsed()) return export_command(export_options);
    if (reporter->parsed()) return report_command(report_options);
    if (fit->parsed()) return fit_command(fit_options);
    if (margins->parsed()) return margins_command(margins_options);
    if (notch->parsed()) return notch_command(notch_options);
    if (comparer->parsed()) return compare_command(compare_options);
    if (list->parsed()) return drivers_command(drivers);
  } catch (const config::ConfigError& error) {
    spdlog::error("{}", error.what());
    return exit_usage;
  } catch (const record::FileExists& error) {
    spdlog::error("{}", error.what());
    return exit_usage;
  } catch (const InputError& error) {
    spdlog::error("{}", error.what());
    return exit_usage;
  } catch (const std::invalid_argument& error) {
    spdlog::error("{}", error.what());
    return exit_usage;
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    return exit_failed;
  }
  return exit_usage;
}

}  // namespace sinerig::cli
