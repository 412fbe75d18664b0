#include "cli/fit_options.h"

#include <string>

#include "cli/file_arguments.h"

namespace sinerig::cli {

CLI::App* add_fit(CLI::App& app, FitCommandOptions& options) {
  CLI::App* fit =
      app.add_subcommand("fit", "Identify a transfer function with delay from responses");
  fit->add_option("FILE", options.files,
                  std::string{measured_file} + "; several are fitted jointly")
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
  fit->add_option("--delay", options.delay,
                  "none, fit (default of ml), or a known delay in seconds (hassul, choe: default "
                  "none)");
  fit->add_option(
         "--hold", options.hold,
         "zero-order hold that drove the plant: auto (the loop of a sweep file), none or 0, or "
         "its rate in Hz")
      ->capture_default_str();
  fit->add_option("--path-delay", options.path_delay_s,
                  "delay of the measuring path in seconds, not part of the model");
  fit->add_option("--static-gain", options.static_gain, "ml: known gain of s^origin G(s) at s = 0");
  fit->add_option("--given-pole", options.given_poles_rad_s, "a known real pole in rad/s");
  fit->add_option(
      "--model-error", options.model_error,
      "relative error of the model itself, added to the scatter, or the scatter where a file "
      "has none (default: for sweep files the least of 0.0001 to 0.002 that explains the "
      "residual, else 0)");
  fit->add_option("--weights", options.weights.weights,
                  "hassul: none, 1/w, column (the CSV's column \"weight\"), W1,W2,... one per "
                  "point, or a file of one number per line")
      ->capture_default_str();
  fit->add_option("--weight-num", options.weights.num,
                  "hassul: weight |W_a(jw)|, numerator of W_a(s), descending powers: C1,C2,...")
      ->delimiter(',');
  fit->add_option("--weight-den", options.weights.den, "hassul: denominator of W_a(s)")
      ->delimiter(',');
  fit->add_option("--bands", options.bands,
                  "choe: number of sub-bands (default: those of the sweep, or one per file where "
                  "they do not overlap, or 3)");
  fit->add_option("--discrete", options.discrete,
                  "discrete equivalent too: tustin, zoh (zero-order hold) or matched")
      ->check(CLI::IsMember({"tustin", "zoh", "matched"}));
  fit->add_option("--rate", options.rate_hz,
                  "rate of the discrete equivalent, Hz (default: the loop of a sweep file)")
      ->check(CLI::PositiveNumber);
  fit->add_option("--prewarp", options.prewarp_hz, "tustin: exact at this frequency, Hz")
      ->check(CLI::NonNegativeNumber);
  fit->add_flag("--trust-units", options.trust_units,
                "take a CSV whose units look wrong as it stands");
  fit->add_flag("--stable", options.stable, "keep poles in the left half plane");
  fit->add_flag("--minimum-phase", options.minimum_phase, "keep zeros in the left half plane");
  fit->add_flag("--keep-outliers", options.keep_outliers, "never leave a point out");
  fit->add_option("--channel", options.channel, "sensor of a sweep file (default: the first)");
  fit->add_flag("--json", options.json, "print one JSON object");
  fit->add_flag("--no-store", options.no_store, "do not store the fit in the sweep files");
  return fit;
}

}  // namespace sinerig::cli
