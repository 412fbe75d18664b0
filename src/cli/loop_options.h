// What closes the loop around a plant, as the options of `margins` and `notch` give it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/plant_model.h"
#include "identify/loop_model.h"

namespace sinerig::cli {

struct LoopOptions {
  std::vector<double> controller_num;  // descending powers of s
  std::vector<double> controller_den;
  std::vector<double> pid;        // KP,KI,KD[,FILTER_HZ]
  std::string controller_file;    // a measured controller, sweep file or CSV
  std::optional<double> rate_hz;  // of the controller; 0: continuous; default: that of the sweep
  std::optional<double> hold_hz;  // the plant was measured behind; 0: none; default: the file's
  double delay_s = 0.0;           // of the loop, beside the plant's
  bool trust_units = false;       // of CSV files
};

// The controller that num/den or pid name, 1 without either, and whether one is named.
// Throws std::invalid_argument for two of them at once, or where one is incomplete.
identify::ZerosPolesGain controller_of(const LoopOptions& options);
bool has_controller(const LoopOptions& options);
std::string controller_text(const LoopOptions& options);

// The rate that the controller runs at; 0: continuous.
double loop_rate_hz(const LoopOptions& options, const FitInput& measured);

// Warns where the file does not say what hold it was measured behind and the loop has one.
void warn_of_unknown_hold(const LoopOptions& options, const FitInput& measured);

// L of the model. Throws std::invalid_argument as LoopModel does.
identify::LoopModel model_loop(const LoopOptions& options, const PlantModel& plant);

// L of the measured points: times the controller, the hold they were measured behind exchanged for
// that of the loop.
identify::Curve measured_loop(const LoopOptions& options, const FitInput& measured);

// L of a model over three times the measured range, and further up to where its phase first crosses
// 180°, as far as that can be.
identify::Curve searched_curve(const identify::LoopModel& loop, const PlantModel& plant);

// L of the model, around a measured controller where there is one.
identify::Curve model_curve(const LoopOptions& options, const PlantModel& plant);

}  // namespace sinerig::cli
