#include "cli/app.h"

#include <cstdio>
#include <iostream>
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <spdlog/cfg/env.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "cli/commands.h"
#include "cli/completion.h"
#include "cli/file_arguments.h"
#include "cli/fit_command.h"
#include "cli/fit_input.h"
#include "cli/fit_options.h"
#include "cli/loop_arguments.h"
#include "cli/margins_command.h"
#include "cli/notch_command.h"
#include "cli/run_arguments.h"
#include "config/misspelt.h"
#include "config/section.h"
#include "record/file_lock.h"
#include "version.h"

namespace sinerig::cli {

namespace {

constexpr const char* description =
    "Measures the frequency response of a gimbal, servo or actuator with stepped sines, in real\n"
    "time, over the bus it already has; or of a simulated plant, in no time.\n"
    "\n"
    "  sinerig plan config/gimbal.toml     what would be run, and for how long; nothing moves\n"
    "  sinerig check config/gimbal.toml    reads every channel for a while; nothing moves\n"
    "  sinerig doctor                      what this machine gives a loop in real time\n"
    "  sinerig run config/gimbal.toml      run it; leaves gimbal.sweep and gimbal.html\n"
    "  sinerig resume gimbal.sweep         go on with it, should it have been interrupted\n"
    "  sinerig night night.toml            several sweeps one after the other\n"
    "  sinerig show gimbal.sweep           the points of a run\n"
    "  sinerig report gimbal.sweep         the report again, or as a picture with --format svg\n"
    "  sinerig export gimbal.sweep --format mat -o gimbal.mat\n"
    "  sinerig fit gimbal.sweep            a transfer function with delay and error bars\n"
    "  sinerig margins gimbal.sweep --pid 3,3,0.15,10\n"
    "  sinerig notch gimbal.sweep --pid 3,3,0.15,10\n"
    "  sinerig compare monday.sweep today.sweep";

constexpr const char* footer =
    "Exit codes: 0 done, 1 failed, 2 usage or configuration, 3 stopped by a limit or a fault,\n"
    "4 interrupted, 5 compare or night found a change. Every key of a rig file is explained in the "
    "files of "
    "config/.";

CLI::App* add_margins(CLI::App& app, MarginsOptions& options) {
  CLI::App* margins = app.add_subcommand(
      "margins", "Gain, phase and delay margin, crossover, Ms, bandwidth and resonances of a loop");
  margins->add_option("FILE", options.file, measured_file)->required();
  margins
      ->add_option("--response", options.response,
                   "what the file is the response of: plant, loop L = PC, sensitivity 1/(1+L) or "
                   "complementary L/(1+L)")
      ->check(CLI::IsMember({"plant", "loop", "sensitivity", "complementary"}))
      ->capture_default_str();
  add_loop_options(*margins, options.loop);
  margins->add_flag("--negate", options.negate,
                    "take minus what was measured: a loop measured as control over torque is -L");
  margins->add_option("--controller-file", options.loop.controller_file,
                      std::string{"measured response of the controller: "} + measured_file);
  margins->add_option("--channel", options.channel, "sensor of a sweep file (default: the first)");
  margins->add_flag("--points-only", options.points_only, "leave the model out");
  margins->add_flag("--refit", options.refit, "fit anew even if the sweep file holds a fit");
  margins->add_flag("--json", options.json, "print one JSON object");
  margins->add_flag("--trust-units", options.loop.trust_units,
                    "take a CSV whose units look wrong as it stands");
  return margins;
}

CLI::App* add_notch(CLI::App& app, NotchOptions& options) {
  CLI::App* notch = app.add_subcommand(
      "notch", "Design notch filters that hold over the uncertainty and drift of the resonances");
  notch
      ->add_option("FILE", options.files,
                   std::string{measured_file} +
                       "; of several the first is the plant, all show how far it drifts")
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
  notch->add_flag("--trust-units", options.loop.trust_units,
                  "take a CSV whose units look wrong as it stands");
  return notch;
}

void set_up_logging(const std::string& level) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("sinerig"));
  spdlog::set_pattern("%^%l%$: %v");
  spdlog::cfg::load_env_levels();
  if (!level.empty()) spdlog::set_level(spdlog::level::from_str(level));
}

bool reader_has_gone() {
  pollfd output{.fd = STDOUT_FILENO, .events = POLLOUT, .revents = 0};
  return poll(&output, 1, 0) == 1 && (output.revents & POLLERR) != 0;
}

// What was printed may still wait in a buffer, or be lost with a full disk: whoever reads the exit
// code would take half a table for a whole one. A reader that has gone wanted no more.
int checked_output(int exit_code) {
  const bool flushed = std::cout.flush().good() && std::fflush(stdout) == 0;
  if ((flushed && std::ferror(stdout) == 0) || reader_has_gone()) return exit_code;
  spdlog::error("standard output cannot be written: what was printed is lost, or a part of it");
  return exit_code == exit_done ? static_cast<int>(exit_failed) : exit_code;
}

// What stands where a command is wanted; empty where nothing does.
std::string first_word(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--log-level") {
      ++i;
    } else if (!word.starts_with('-')) {
      return word;
    }
  }
  return {};
}

// Of a command with a slip of the finger in it.
std::string meant(const CLI::App& app, const std::string& word) {
  for (const CLI::App* command : app.get_subcommands({})) {
    if (config::is_misspelt(word, command->get_name()))
      return "; did you mean " + command->get_name() + "?";
  }
  return {};
}

int run_command_line(int argc, char** argv, const std::vector<DriverKit>& drivers) {
  CLI::App app{description, "sinerig"};
  app.footer(footer);
  app.set_version_flag("--version", std::string{"sinerig "} + version);
  app.require_subcommand(1);
  app.fallthrough();
  std::string log_level;
  app.add_option("--log-level", log_level,
                 "trace, debug, info, warn, error or off (also: SPDLOG_LEVEL)")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}));

  PlanOptions plan_options;
  CLI::App* plan = add_plan(app, plan_options);
  RunOptions run_options;
  CLI::App* run = add_run(app, run_options);
  ResumeOptions resume_options;
  CLI::App* resume = add_resume(app, resume_options);
  NightOptions night_options;
  CLI::App* night = add_night(app, night_options);
  ShowOptions show_options;
  CLI::App* show = add_show(app, show_options);
  ExportOptions export_options;
  CLI::App* exporter = add_export(app, export_options);
  ReportOptions report_options;
  CLI::App* reporter = add_report(app, report_options);
  CheckOptions check_options;
  CLI::App* check = add_check(app, check_options);
  DoctorOptions doctor_options;
  CLI::App* doctor = add_doctor(app, doctor_options);
  FitCommandOptions fit_options;
  CLI::App* fit = add_fit(app, fit_options);
  MarginsOptions margins_options;
  CLI::App* margins = add_margins(app, margins_options);
  NotchOptions notch_options;
  CLI::App* notch = add_notch(app, notch_options);
  CompareOptions compare_options;
  CLI::App* comparer = add_compare(app, compare_options);
  CLI::App* list = app.add_subcommand("drivers", "List the drivers of this build");
  std::string shell;
  CLI::App* completion = app.add_subcommand(
      "completion", "Print the completion script of a shell: source <(sinerig completion bash)");
  completion->add_option("SHELL", shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  CLI::App* manual =
      app.add_subcommand("manual", "Print the manual page: sinerig manual | man -l -");

  try {
    app.parse(arguments_of(argc, argv));
  } catch (const CLI::RequiredError& error) {
    const std::string word = first_word(argc, argv);
    if (app.get_subcommands().empty() && word == "help") {
      std::cout << app.help();
      return exit_done;
    }
    set_up_logging({});
    if (!app.get_subcommands().empty() || word.empty()) {
      app.exit(error);
    } else {
      spdlog::error("there is no command \"{}\"{}; sinerig --help lists them", word,
                    meant(app, word));
    }
    return exit_usage;
  } catch (const CLI::ParseError& error) {
    const int exit_code = app.exit(error) == 0 ? exit_done : exit_usage;
    set_up_logging({});
    return exit_code;
  }
  set_up_logging(log_level);
  const bool hushed = run_options.voice != Voice::text || night_options.voice != Voice::text ||
                      resume_options.voice != Voice::text || compare_options.voice == Voice::quiet;
  if (hushed && log_level.empty()) spdlog::set_level(spdlog::level::warn);

  try {
    if (plan->parsed()) return plan_command(plan_options, drivers);
    if (check->parsed()) return check_command(check_options, drivers);
    if (doctor->parsed()) return doctor_command(doctor_options);
    if (run->parsed()) return run_command(run_options, drivers);
    if (resume->parsed()) return resume_command(resume_options, drivers);
    if (night->parsed()) return night_command(night_options, drivers);
    if (show->parsed()) return show_command(show_options);
    if (exporter->parsed()) return export_command(export_options);
    if (reporter->parsed()) return report_command(report_options);
    if (fit->parsed()) return fit_command(fit_options);
    if (margins->parsed()) return margins_command(margins_options);
    if (notch->parsed()) return notch_command(notch_options);
    if (comparer->parsed()) return compare_command(compare_options);
    if (list->parsed()) return drivers_command(drivers);
    if (completion->parsed()) {
      write_completion(std::cout, app, shell);
      return exit_done;
    }
    if (manual->parsed()) {
      write_manual(std::cout, app);
      return exit_done;
    }
  } catch (const config::ConfigError& error) {
    spdlog::error("{}", error.what());
    return exit_usage;
  } catch (const record::FileExists& error) {
    spdlog::error("{}", error.what());
    return exit_usage;
  } catch (const record::FileInUse& error) {
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

}  // namespace

int run_app(int argc, char** argv, const std::vector<DriverKit>& drivers) {
  return checked_output(run_command_line(argc, argv, drivers));
}

}  // namespace sinerig::cli
