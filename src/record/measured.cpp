#include "record/measured.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <limits>

#include "record/csv_reader.h"
#include "record/csv_text.h"
#include "record/mat_file.h"
#include "record/uff58.h"

namespace sinerig::record {

namespace {

namespace fs = std::filesystem;

std::string extension_of(const std::string& path) {
  std::string extension = fs::path{path}.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char each) { return static_cast<char>(std::tolower(each)); });
  return extension;
}

bool is_foreign(const std::string& extension) {
  constexpr const char* known[] = {".csv", ".txt", ".mat", ".uff", ".unv"};
  return std::find(std::begin(known), std::end(known), extension) != std::end(known);
}

// The index of a channel of this name and unit, added where it is new.
std::uint32_t channel_index(std::vector<ChannelInfo>& channels, const ChannelInfo& wanted) {
  const auto found = std::find_if(channels.begin() + 2, channels.end(), [&](const auto& each) {
    return each.name == wanted.name && each.unit == wanted.unit;
  });
  if (found != channels.end()) return static_cast<std::uint32_t>(found - channels.begin());
  channels.push_back(wanted);
  return static_cast<std::uint32_t>(channels.size() - 1);
}

// A point at DC, at a negative frequency or at none has no place on a logarithmic axis nor in a
// fit.
void leave_out_unusable(std::vector<ImportedResponse>& responses, const std::string& path) {
  for (ImportedResponse& response : responses)
    response.left_out += std::erase_if(response.points, [](const StoredPoint& point) {
      return !(point.frequency_hz > 0.0) || !std::isfinite(point.frequency_hz);
    });
  std::erase_if(responses, [](const ImportedResponse& each) { return each.points.empty(); });
  if (responses.empty()) throw SweepFileError(path + ": has no point at a frequency above zero");
}

}  // namespace

StoredPoint imported_point() {
  StoredPoint point;
  point.frequency_hz = nan_value;
  point.response = {nan_value, nan_value};
  point.covariance = {nan_value, nan_value, nan_value};
  for (double StoredPoint::*member :
       {&StoredPoint::gain_interval_db, &StoredPoint::phase_interval_deg,
        &StoredPoint::input_amplitude, &StoredPoint::output_amplitude, &StoredPoint::snr_db,
        &StoredPoint::distortion, &StoredPoint::drift_per_s, &StoredPoint::samples,
        &StoredPoint::lost, &StoredPoint::seconds, &StoredPoint::reason_value})
    point.*member = nan_value;
  point.status = "imported";
  return point;
}

ChannelInfo channel_from_text(const std::string& text) {
  const std::string all = trimmed_field(text);
  if (all.empty() || all.back() != ']') return {all, ""};
  int depth = 0;
  for (std::size_t open = all.size(); open-- > 0;) {
    depth += all[open] == ']' ? 1 : all[open] == '[' ? -1 : 0;
    if (depth == 0)
      return {trimmed_field(all.substr(0, open)), all.substr(open + 1, all.size() - open - 2)};
  }
  return {all, ""};
}

std::vector<ImportedResponse> import_responses(const std::string& path) {
  if (!fs::exists(path)) throw SweepFileError(path + ": does not exist");
  const std::string extension = extension_of(path);
  std::vector<ImportedResponse> responses;
  if (extension == ".csv" || extension == ".txt") {
    responses = {read_csv(path)};
  } else if (extension == ".mat") {
    responses = read_mat(path);
  } else if (extension == ".uff" || extension == ".unv") {
    responses = read_uff58(path);
  } else {
    throw SweepFileError(path +
                         ": the format is told by the extension, which has to be .sweep, .csv, "
                         ".txt, .mat, .uff or .unv");
  }
  leave_out_unusable(responses, path);
  for (ImportedResponse& response : responses) {
    std::stable_sort(response.points.begin(), response.points.end(),
                     [](const auto& a, const auto& b) { return a.frequency_hz < b.frequency_hz; });
  }
  return responses;
}

StoredRun run_of(const std::vector<ImportedResponse>& responses, const std::string& path) {
  StoredRun run;
  run.facts["imported_from"] = fs::path{path}.filename().string();
  run.channels = {{"command", ""}, {"applied", ""}};
  std::size_t left_out = 0;
  for (const ImportedResponse& each : responses) left_out += each.left_out;
  if (left_out > 0) run.facts[left_out_fact] = std::to_string(left_out);
  for (const ImportedResponse& each : responses) {
    StoredResponse response;
    const bool applied = each.input.name.empty() || each.input.name == "applied";
    if (applied) run.channels[1].unit = run.channels[0].unit = each.input.unit;
    response.input = applied ? 1U : channel_index(run.channels, each.input);
    response.output = channel_index(run.channels, each.output);
    response.points = each.points;
    response.hold_rate_hz = each.hold_rate_hz;
    run.plan.rate_hz = std::max(run.plan.rate_hz, each.hold_rate_hz);
    for (std::size_t i = 0; i < response.points.size(); ++i) {
      response.points[i].dwell = static_cast<std::uint32_t>(i);
      response.points[i].input = response.input;
      response.points[i].output = response.output;
    }
    run.responses.push_back(std::move(response));
  }
  return run;
}

StoredRun read_measured(const std::string& path) {
  if (is_foreign(extension_of(path))) return run_of(import_responses(path), path);
  return read_sweep(path);
}

}  // namespace sinerig::record
