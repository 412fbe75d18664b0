#include "cli/fit_input.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include <spdlog/spdlog.h>

#include "cli/measured_run.h"
#include "identify/scatter.h"

namespace sinerig::cli {

namespace {

constexpr double turn = 2.0 * std::numbers::pi;

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char each) { return static_cast<char>(std::tolower(each)); });
  return text;
}

// By its name, too: what is damaged is not taken for a table.
bool is_sweep_file(const std::string& path) {
  refuse_folder(path);
  std::ifstream file{path, std::ios::binary};
  if (!file) throw record::SweepFileError(path + ": cannot be read; check the name");
  std::string magic(15, '\0');
  file.read(magic.data(), static_cast<std::streamsize>(magic.size()));
  return magic == "SQLite format 3" || lower_case(path).ends_with(".sweep");
}

// Between the sub-bands of a sweep by sub-bands that do not overlap; empty where it is none.
std::vector<double> edges_between_sub_bands(const record::StoredRun& run) {
  std::map<std::uint32_t, std::pair<double, double>> reach;  // of each sub-band, Hz
  for (const Dwell& dwell : run.plan.dwells) {
    for (const Tone& tone : dwell.tones) {
      const double hz = dwell.tone_hz(tone, run.plan.rate_hz);
      auto& [low, high] = reach.try_emplace(dwell.sub_band, hz, hz).first->second;
      low = std::min(low, hz);
      high = std::max(high, hz);
    }
  }
  std::vector<std::pair<double, double>> bands;
  for (const auto& [number, band] : reach) bands.push_back(band);
  return edges_between(bands);
}

FitInput from_run(const record::StoredRun& run, const std::string& path,
                  const std::string& channel) {
  const auto wanted = std::find_if(run.responses.begin(), run.responses.end(), [&](const auto& r) {
    return channel.empty() || is_named(run, r, channel);
  });
  if (wanted == run.responses.end()) {
    throw record::SweepFileError(path + ": has no response of \"" + channel + "\"; it has" +
                                 names_of_responses(run));
  }
  FitInput input;
  input.rate_hz = run.plan.rate_hz;
  input.hold_hz = wanted->hold_rate_hz;
  input.input = wanted->input;
  input.output = wanted->output;
  input.driven_by_command = wanted->input <= 1;
  input.band_edges_rad_s = edges_between_sub_bands(run);
  input.label = run.channels.at(wanted->input).name + " to " + run.channels.at(wanted->output).name;
  std::vector<double> degrees_of_freedom;
  for (const record::StoredPoint& point : wanted->points) {
    if (point.status != "good" && point.status != "imported") continue;
    const bool scatter = point.dof > 0.0;
    input.response.push_back(
        {turn * point.frequency_hz, point.response, scatter ? point.covariance.re_re : 0.0,
         scatter ? point.covariance.re_im : 0.0, scatter ? point.covariance.im_im : 0.0});
    degrees_of_freedom.push_back(point.dof);
  }
  const std::size_t left_out = wanted->points.size() - degrees_of_freedom.size();
  if (left_out > 0) spdlog::warn("{} points are not good and are left out", left_out);
  const bool pooled = std::all_of(degrees_of_freedom.begin(), degrees_of_freedom.end(),
                                  [](double dof) { return std::isfinite(dof); });
  if (pooled) input.response = identify::pooled_scatter(input.response, degrees_of_freedom);
  return input;
}

}  // namespace

void take_hold(FitInput& input, double hold_hz) {
  if (!(hold_hz >= 0.0) || !std::isfinite(hold_hz))
    throw std::invalid_argument("--hold: wanted the rate of the hold in Hz, or 0 for none");
  input.hold_hz = hold_hz;
  if (input.rate_hz == 0.0) input.rate_hz = hold_hz;
}

std::vector<double> edges_between(std::vector<std::pair<double, double>> bands_hz) {
  std::sort(bands_hz.begin(), bands_hz.end());
  std::vector<double> edges;
  for (std::size_t i = 1; i < bands_hz.size(); ++i) {
    if (bands_hz[i].first <= bands_hz[i - 1].second) return {};
    edges.push_back(turn * std::sqrt(bands_hz[i - 1].second * bands_hz[i].first));
  }
  return edges;
}

FitInput read_fit_input(const std::string& path, const std::string& channel, bool trust_units) {
  if (is_sweep_file(path)) {
    FitInput input = from_run(record::read_sweep(path), path, channel);
    input.sweep_file = true;
    return input;
  }
  for (const char* extension : {".mat", ".uff", ".unv"}) {
    if (lower_case(path).ends_with(extension)) return from_run(read_run(path), path, channel);
  }
  CsvResponse csv = read_csv_response(path, trust_units);
  FitInput input;
  input.response = std::move(csv.response);
  input.weights = std::move(csv.weights);
  input.rate_hz = input.hold_hz = csv.hold_rate_hz;
  input.label = path;
  return input;
}

}  // namespace sinerig::cli
