#include "cli/file_arguments.h"

#include "cli/loop_arguments.h"
#include "cli/run_arguments.h"

namespace sinerig::cli {

CLI::App* add_show(CLI::App& app, ShowOptions& options) {
  CLI::App* show =
      app.add_subcommand("show", "Print a sweep file: how the run went and its points");
  show->add_option("FILE", options.file, measured_file)->required();
  show->add_flag("--json", options.json, "print what `export --format json` writes");
  return show;
}

CLI::App* add_export(CLI::App& app, ExportOptions& options) {
  CLI::App* exporter = app.add_subcommand(
      "export", "Write responses for other programs: CSV, JSON, MATLAB, UFF 58, source text");
  exporter->add_option("FILE", options.file, measured_file)->required();
  exporter
      ->add_option("--format", options.format,
                   "csv; json; mat: MATLAB 5, the fields of frd and idfrd; uff: dataset 58; "
                   "snippet: Python source, or MATLAB's with -o NAME.m")
      ->check(CLI::IsMember({"csv", "json", "mat", "uff", "snippet"}))
      ->capture_default_str();
  exporter->add_option("-o,--output", options.output, "file to write (default: standard output)");
  exporter->add_option(
      "--channel", options.channel,
      "sensor whose response is written (default: the first; all in json, mat and uff)");
  exporter->add_flag("--force", options.force, "replace the file if it exists");
  return exporter;
}

CLI::App* add_report(CLI::App& app, ReportOptions& options) {
  CLI::App* reporter = app.add_subcommand(
      "report",
      "Write a sweep file's report: one HTML page for any browser, or a picture. With a "
      "controller the page shows the loop, its margins and a notch for it, before and after");
  reporter->add_option("FILE", options.file, measured_file)->required();
  reporter
      ->add_option("--format", options.format,
                   "html: the interactive page; svg or png: the Bode plot of one response")
      ->check(CLI::IsMember({"html", "svg", "png"}))
      ->capture_default_str();
  reporter->add_option("-o,--output", options.output,
                       "file to write (default: FILE's name with the format's extension)");
  reporter->add_option("--channel", options.channel,
                       "sensor of the picture and of the loop (default: the first)");
  reporter->add_flag("--force", options.force,
                     "replace the file if it exists (a report is replaced anyway)");
  add_loop_options(*reporter, options.loop);
  return reporter;
}

CLI::App* add_compare(CLI::App& app, CompareOptions& options) {
  CLI::App* comparer = app.add_subcommand(
      "compare", "Tell whether measurements differ by more than their scatter explains");
  comparer->add_option("FILES", options.files, "files; the first is the reference")
      ->required()
      ->expected(2, -1);
  comparer
      ->add_option("--tolerance-db", options.settings.tolerance_db,
                   "changes of the gain up to this are none, dB")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  comparer
      ->add_option("--tolerance-deg", options.settings.tolerance_deg,
                   "changes of the phase up to this are none, degrees")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  comparer
      ->add_option("--false-alarm", options.settings.false_alarm,
                   "chance to call two equal responses different")
      ->check(CLI::Range(1e-12, 0.5))
      ->capture_default_str();
  comparer->add_option("-o,--output", options.output, "page that lays them over each other");
  comparer->add_flag("--force", options.force, "replace the page if it exists");
  comparer->add_flag("--drift", options.drift,
                     "compare the resonances of the models, too; with a controller the margins");
  add_loop_options(*comparer, options.loop);
  comparer->add_option("--channel", options.channel,
                       "sensor whose model is compared (default: the first)");
  comparer
      ->add_option("--tolerance-percent", options.tolerance_percent,
                   "changes of a resonance or margin up to this part of it are none")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  add_voice(*comparer, options.voice, "print nothing: the exit code tells",
            "print one JSON object");
  return comparer;
}

}  // namespace sinerig::cli
