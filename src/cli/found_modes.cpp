#include "cli/found_modes.h"

#include <algorithm>
#include <cmath>
#include <exception>

#include <Eigen/Core>

#include "cli/plant_model.h"
#include "identify/transient_modes.h"
#include "record/sweep_reader.h"

namespace sinerig::cli {

namespace {

// The record says less of the poles than its linearised covariance: this much of them is doubted
// beside it.
constexpr double least_doubt = 1e-6;

// A real pole that moves by less than this over the record, or by no more than so many standard
// errors, looks like the constant of the regression, which stands for it: an integrator.
constexpr double looks_constant = 0.05;
constexpr double looks_constant_sigmas = 4.0;

// A transient that is gone by this part within the blind ticks is not seen in a dwell.
constexpr double gone = 1e-5;

constexpr int most_delay_ticks = 4;

// What a night does to a mode beside what the fit did not know: parts of its frequency and decay.
constexpr double moved_frequency = 0.01;
constexpr double moved_decay = 0.2;

// The noise of another night is known as if from so few samples.
constexpr double other_night_dof = 10.0;

std::size_t size_of(std::complex<double> pole) {
  return pole.imag() == 0.0 ? 1 : 2;
}

// The poles that a dwell can see, those that ring longest first where there are too many.
ModePrior prior_of(const identify::FoundModes& modes, double period_s, double seconds) {
  ModePrior prior;
  prior.blind_ticks = most_delay_ticks + 1;
  std::vector<std::size_t> rows;  // of the covariance
  std::size_t row = 0;
  for (const std::complex<double>& pole : modes.poles) {
    const std::size_t size = size_of(pole);
    const double seen = std::exp(pole.real() * period_s * prior.blind_ticks);
    const auto at = static_cast<Eigen::Index>(row);
    const double doubt = std::sqrt(modes.covariance(at, at));
    const bool rests =
        pole.imag() == 0.0 &&
        std::abs(pole.real()) < std::max(looks_constant / seconds, looks_constant_sigmas * doubt);
    if (prior.modes < ModePrior::max_modes && seen > gone && !rests) {
      prior.poles[prior.modes++] = {.sigma_rad_s = pole.real(), .omega_rad_s = pole.imag()};
      for (std::size_t k = 0; k < size; ++k) rows.push_back(row + k);
    }
    row += size;
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      prior.covariance[triangle(i) + j] =
          modes.covariance(static_cast<Eigen::Index>(rows[i]), static_cast<Eigen::Index>(rows[j]));
    }
  }
  std::size_t index = 0;
  for (const ModePole& pole : prior.known()) {
    for (std::size_t k = 0; k < pole.size(); ++k, ++index) {
      const double size = std::hypot(pole.sigma_rad_s, pole.omega_rad_s);
      prior.covariance[triangle(index) + index] += least_doubt * least_doubt * size * size;
    }
  }
  return prior;
}

// Median over the good points of the variance that the tone leaves.
double noise_variance(const record::StoredResponse& response) {
  std::vector<double> variances;
  for (const record::StoredPoint& point : response.points) {
    if (point.status != "good") continue;
    const double power = 0.5 * point.output_amplitude * point.output_amplitude;
    variances.push_back(power * std::pow(10.0, -point.snr_db / 10.0));
  }
  if (variances.empty()) return 0.0;
  const auto middle = variances.begin() + static_cast<std::ptrdiff_t>(variances.size() / 2);
  std::nth_element(variances.begin(), middle, variances.end());
  return *middle;
}

}  // namespace

KnownModes modes_of_file(const std::string& path, const std::vector<std::string>& outputs) {
  const PlantModel model = read_plant_model(path, outputs.front(), false);
  KnownModes known;
  known.noise_dof = other_night_dof;
  known.prior.blind_ticks = most_delay_ticks + 1;
  std::size_t index = 0;
  for (const identify::Mode& mode : model.modes) {
    if (known.prior.modes == ModePrior::max_modes || !(mode.pole.real() < 0.0)) continue;
    known.prior.poles[known.prior.modes++] = {.sigma_rad_s = mode.pole.real(),
                                              .omega_rad_s = mode.pole.imag()};
    const double natural = std::abs(mode.pole);
    const double decay =
        std::hypot(moved_decay * mode.pole.real(), natural * mode.damping.standard_error);
    const double turn = natural * std::hypot(moved_frequency, mode.frequency_hz.standard_error /
                                                                  mode.frequency_hz.value);
    const bool real = mode.pole.imag() == 0.0;
    known.prior.covariance[triangle(index) + index] =
        real ? std::max(decay, turn) * std::max(decay, turn) : decay * decay;
    if (!real) known.prior.covariance[triangle(index + 1) + index + 1] = turn * turn;
    index += real ? 1 : 2;
  }
  const record::StoredRun run = record::read_sweep(path);
  for (const std::string& name : outputs) {
    double variance = 0.0;
    for (const record::StoredResponse& response : run.responses) {
      if (run.channels.at(response.output).name == name) variance = noise_variance(response);
    }
    if (!(variance > 0.0)) {
      throw record::SweepFileError(path + ": holds no good point of \"" + name +
                                   "\", so its noise is not known; take another prior, or none");
    }
    known.noise_variance.push_back(variance);
  }
  return known;
}

bool IdentifiedModes::find(const ProbeRecord& record, KnownModes& found) noexcept {
  try {
    found = {};
    identify::ModeSettings settings{
        .most_delay_ticks = most_delay_ticks,
        .lowest_hz = record.low_hz,
        .highest_hz = std::min(2.0 * record.high_hz, 0.4 / record.period_s)};
    identify::MotionRecord motion{.period_s = record.period_s,
                                  .input = {record.applied.begin(), record.applied.end()},
                                  .output = {}};
    for (std::size_t i = 0; i < record.outputs.size(); ++i) {
      motion.output.assign(record.outputs[i].begin(), record.outputs[i].end());
      const identify::FoundModes modes = identify::find_modes(motion, settings);
      found.noise_variance.push_back(modes.noise_variance);
      if (i > 0) continue;
      found.noise_dof = modes.degrees_of_freedom;
      found.prior = prior_of(modes, record.period_s,
                             record.period_s * static_cast<double>(motion.input.size()));
    }
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

}  // namespace sinerig::cli
