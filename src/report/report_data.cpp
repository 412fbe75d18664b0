#include "report/report_data.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <nlohmann/json.hpp>

#include "identify/transfer_function.h"
#include "record/confidence.h"
#include "record/text.h"
#include "report/comparison.h"
#include "report/model_curve.h"
#include "report/run_summary.h"

namespace sinerig::report {

namespace {

using Json = nlohmann::ordered_json;
using record::StoredPoint;
using record::StoredResponse;
using record::StoredRun;
using record::text;

template <typename Value>
Json column(const std::vector<StoredPoint>& points, int digits, Value value) {
  Json all = Json::array();
  for (const StoredPoint& point : points) all.push_back(rounded(value(point), digits));
  return all;
}

template <typename Value>
Json texts(const std::vector<StoredPoint>& points, Value value) {
  Json all = Json::array();
  for (const StoredPoint& point : points) all.push_back(value(point));
  return all;
}

Json roots_json(const std::vector<std::complex<double>>& roots) {
  Json all = Json::array();
  for (const auto& root : roots) all.push_back({rounded(root.real(), 9), rounded(root.imag(), 9)});
  return all;
}

Json model_json(const record::StoredFit& fit, const StoredResponse& response) {
  Json model{{"label", fit.label}, {"f", Json::array()}, {"re", Json::array()}};
  model["im"] = model["at_re"] = model["at_im"] = Json::array();
  std::vector<double> grid;
  for (const StoredPoint& point : response.points) grid.push_back(point.frequency_hz);
  for (const std::complex<double>& value : model_response(fit, grid)) {
    model["at_re"].push_back(rounded(value.real(), 9));
    model["at_im"].push_back(rounded(value.imag(), 9));
  }
  for (const double each : curve_grid(fit, grid.front(), grid.back())) grid.push_back(each);
  std::sort(grid.begin(), grid.end());
  const std::vector<std::complex<double>> curve = model_response(fit, grid);
  const ModelBand band = model_band(fit, grid);
  for (std::size_t i = 0; i < grid.size(); ++i) {
    model["f"].push_back(rounded(grid[i], 8));
    model["re"].push_back(rounded(curve[i].real(), 7));
    model["im"].push_back(rounded(curve[i].imag(), 7));
  }
  model["gain95"] = model["phase95"] = Json::array();
  for (const double each : band.gain) model["gain95"].push_back(rounded(each, 4));
  for (const double each : band.phase_rad) model["phase95"].push_back(rounded(each, 4));
  model["facts"] = fit.facts;
  model["poles"] = roots_json(fit.poles);
  model["zeros"] = roots_json(fit.zeros);
  return model;
}

Json models_json(const StoredRun& run, const StoredResponse& response) {
  Json models = Json::array();
  const record::StoredFit* fit = latest_fit(run, response);
  if (fit != nullptr && !response.points.empty()) models.push_back(model_json(*fit, response));
  return models;
}

// The models of the sub-bands and their mean, the differences, and the weight, by magnitude.
Json choe_json(const StoredRun& run, const StoredResponse& response) {
  const record::StoredFit* fit = latest_choe(run, response);
  if (fit == nullptr) return nullptr;
  const record::StoredChoe& choe = *fit->choe;
  Json json{{"f", Json::array()}, {"bands", Json::array()}};
  for (const double each : choe.freq_hz) json["f"].push_back(rounded(each, 8));
  for (std::size_t k = 0; k < choe.bands.size(); ++k) {
    const auto& band = choe.bands[k];
    const identify::TransferFunction model{.num = band.num, .den = band.den};
    Json gain = Json::array();
    Json additive = Json::array();
    for (std::size_t i = 0; i < choe.freq_hz.size(); ++i) {
      const double omega = 2.0 * std::numbers::pi * choe.freq_hz[i];
      gain.push_back(rounded(std::abs(model.at(omega)), 7));
      additive.push_back(rounded(choe.additive[k][i], 7));
    }
    json["bands"].push_back({{"low_hz", rounded(band.low_hz, 8)},
                             {"high_hz", rounded(band.high_hz, 8)},
                             {"gain", gain},
                             {"additive", additive}});
  }
  json["nominal"] = json["weight"] = Json::array();
  for (const auto& each : choe.nominal) json["nominal"].push_back(rounded(std::abs(each), 7));
  for (const double each : choe.weight) json["weight"].push_back(rounded(each, 7));
  return json;
}

// Figures that get a plot each only where they hold something.
Json more_json(const std::vector<StoredPoint>& points) {
  std::map<std::string, std::vector<double>> columns;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto put = [&](const std::string& name, double value) {
      columns.try_emplace(name, points.size(), std::nan("")).first->second[i] = value;
    };
    put("bench time, s", points[i].seconds);
    put("samples lost", points[i].lost);
    put("drift per s", points[i].drift_per_s);
    for (const auto& [name, value] : points[i].more) put(name, value);
  }
  Json more = Json::object();
  for (const auto& [name, values] : columns) {
    const bool empty = std::none_of(values.begin(), values.end(), [](double value) {
      return std::isfinite(value) && value != 0.0;
    });
    if (empty) continue;
    for (const double value : values) more[name].push_back(rounded(value, 6));
  }
  return more;
}

Json response_json(const StoredRun& run, const StoredResponse& response, const std::string& name,
                   std::size_t run_index) {
  Json json{{"run", run_index},
            {"name", name},
            {"input", run.channels.at(response.input).name},
            {"unit", response_unit(run, response)},
            {"input_unit", run.channels.at(response.input).unit},
            {"output_unit", run.channels.at(response.output).unit}};
  json.update(point_columns(response.points));
  json["models"] = models_json(run, response);
  json["choe"] = choe_json(run, response);
  return json;
}

Json difference_json(const record::Difference& difference) {
  Json json{{"name", difference.name}, {"verdict", verdict(difference)}};
  const auto add = [&](const char* key, int digits, auto value) {
    json[key] = Json::array();
    for (const record::PointDifference& point : difference.points)
      json[key].push_back(rounded(value(point), digits));
  };
  add("f", 9, [](const auto& p) { return p.frequency_hz; });
  add("gain_db", 7, [](const auto& p) { return p.gain_db; });
  add("gain95_db", 5, [](const auto& p) { return p.gain95_db; });
  add("phase_deg", 7, [](const auto& p) { return p.phase_deg; });
  add("phase95_deg", 5, [](const auto& p) { return p.phase95_deg; });
  add("p", 3, [](const auto& p) { return p.probability; });
  json["changed"] = Json::array();
  for (const record::PointDifference& point : difference.points)
    json["changed"].push_back(point.changed);
  return json;
}

std::string difference_counts(const record::Difference& difference) {
  std::string words =
      text("%zu of %zu points changed", difference.changed_points(), difference.points.size());
  if (difference.lost > 0) words += text(", %zu lost: not good any more", difference.lost);
  if (difference.unmatched > 0) words += text(", %zu unmatched", difference.unmatched);
  return words;
}

bool held(const StoredRun& run) {
  return std::any_of(run.responses.begin(), run.responses.end(),
                     [](const StoredResponse& each) { return each.hold_rate_hz > 0.0; });
}

std::vector<std::string> notes(bool any_held) {
  std::vector<std::string> words{
      "H is the ratio of two measured Fourier coefficients, output over input: with the input "
      "A₀ sin ωt and the steady output a₀ + a₁ cos ωt + b₁ sin ωt the gain is √(a₁² + b₁²)/A₀ and "
      "the phase atan2(a₁, b₁); a lag is negative.",
      "Intervals hold the true value in 95 of 100 cases. Signal to noise is the power of the tone "
      "over that of the residual, per sample; coherence is the part of the output's power that "
      "goes "
      "with the input, over records of one cycle; distortion is that of the harmonics, relative to "
      "the "
      "tone. Points are drawn whatever their status; only good ones are filled."};
  // Nobody knows what has driven a rig that others have measured.
  if (any_held) {
    words.emplace_back(
        "The rig saw a zero-order hold at the rate of the loop; the measured response includes "
        "it.");
  }
  return words;
}

}  // namespace

Json rounded(double value, int digits) {
  if (!std::isfinite(value)) return nullptr;
  char text[40];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return std::strtod(text, nullptr);
}

std::string response_name(const StoredRun& run, const StoredResponse& response) {
  const std::string& output = run.channels.at(response.output).name;
  const std::string& input = run.channels.at(response.input).name;
  return input == "applied" || input.empty() ? output : output + " / " + input;
}

std::string response_unit(const StoredRun& run, const StoredResponse& response) {
  const auto bracketed = [](const std::string& unit) {
    return unit.find('/') == std::string::npos ? unit : "(" + unit + ")";
  };
  const std::string& input = run.channels.at(response.input).unit;
  const std::string& output = run.channels.at(response.output).unit;
  if (input == output) return "1";
  if (input == "1" || input.empty()) return output;
  return (output.empty() ? "1" : bracketed(output)) + "/" + bracketed(input);
}

Json point_columns(const std::vector<StoredPoint>& points) {
  Json json = Json::object();
  json["f"] = column(points, 9, [](const auto& p) { return p.frequency_hz; });
  json["re"] = column(points, 9, [](const auto& p) { return p.response.real(); });
  json["im"] = column(points, 9, [](const auto& p) { return p.response.imag(); });
  json["var_re"] = column(points, 4, [](const auto& p) { return p.covariance.re_re; });
  json["cov_re_im"] = column(points, 4, [](const auto& p) { return p.covariance.re_im; });
  json["var_im"] = column(points, 4, [](const auto& p) { return p.covariance.im_im; });
  json["gain95"] = column(points, 5, [](const auto& p) { return half_width95(p).gain; });
  json["phase95"] = column(points, 5, [](const auto& p) { return half_width95(p).phase_rad; });
  json["snr"] = column(points, 5, [](const auto& p) { return p.snr_db; });
  json["coherence"] = column(points, 7, [](const auto& p) { return p.coherence; });
  json["amplitude"] = column(points, 6, [](const auto& p) { return p.input_amplitude; });
  json["response"] = column(points, 6, [](const auto& p) { return p.output_amplitude; });
  json["distortion"] = column(points, 5, [](const auto& p) { return p.distortion; });
  json["samples"] = column(points, 8, [](const auto& p) { return p.samples; });
  json["status"] = texts(points, [](const auto& p) { return p.status; });
  json["reason"] = texts(points, [](const auto& p) { return p.reason; });
  json["settled"] = texts(points, [](const auto& p) { return p.settled_by; });
  json["extra"] = more_json(points);
  return json;
}

Json page_of_run(const LabelledRun& labelled) {
  const StoredRun& run = labelled.run;
  Json responses = Json::array();
  for (const StoredResponse& response : run.responses)
    responses.push_back(response_json(run, response, response_name(run, response), 0));
  return {{"kind", "run"},
          {"title", labelled.label},
          {"about", about_run(run)},
          {"outcome", outcome_of(run)},
          {"outcome_text", outcome_text(run)},
          {"summary", summary_facts(run)},
          {"runs", Json::array({run_json(labelled)})},
          {"responses", responses},
          {"differences", Json::array()},
          {"notes", notes(held(run))}};
}

Json page_of_comparison(const std::vector<LabelledRun>& runs,
                        const std::vector<record::Difference>& differences) {
  std::string title;
  Json run_list = Json::array();
  Json responses = Json::array();
  for (std::size_t i = 0; i < runs.size(); ++i) {
    title += (i == 0 ? "" : i == 1 ? " against " : ", ") + runs[i].label;
    run_list.push_back(run_json(runs[i]));
    for (const StoredResponse& response : runs[i].run.responses) {
      const std::string name = runs[i].label + " " + response_name(runs[i].run, response);
      responses.push_back(response_json(runs[i].run, response, name, i));
    }
  }
  bool changed = false;
  bool scatter_known = false;
  Json differences_list = Json::array();
  Json summary = Json::array();
  for (const record::Difference& each : differences) {
    changed = changed || each.changed();
    scatter_known = scatter_known || each.scatter_known();
    differences_list.push_back(difference_json(each));
    summary.push_back({each.name, verdict_word(each), difference_counts(each)});
  }
  std::vector<std::string> labels;
  bool any_held = false;
  for (const LabelledRun& each : runs) {
    labels.push_back(each.label);
    any_held = any_held || held(each.run);
  }
  // As the program's exit code has it: a change comes first, then what could not be compared.
  std::string outcome = "done";
  std::string outcome_text = scatter_known ? "same within the scatter" : "same within tolerances";
  if (changed) {
    outcome = outcome_text = "changed";
  } else if (const auto without = files_without_points(labels, differences); !without.empty()) {
    outcome = "failed";
    outcome_text = "nothing to compare";
    for (std::size_t i = 0; i < without.size(); ++i)
      outcome_text += (i == 0 ? " in " : ", ") + without[i];
  }
  return {{"kind", "compare"},
          {"title", title},
          {"about", "each later file against the first, at the frequencies that both have"},
          {"outcome", outcome},
          {"outcome_text", outcome_text},
          {"summary", summary},
          {"runs", run_list},
          {"responses", responses},
          {"differences", differences_list},
          {"notes", notes(any_held)}};
}

}  // namespace sinerig::report
