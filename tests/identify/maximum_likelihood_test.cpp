#include "identify/maximum_likelihood.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "identify/hold.h"
#include "plants.h"

namespace sinerig::identify {
namespace {

using namespace test;
using testing::HasSubstr;
using Complex = std::complex<double>;
using Random = std::mt19937_64;

FitOptions options_for(const ZerosPolesGain& plant, Delay delay) {
  FitOptions options;
  options.poles = static_cast<int>(plant.poles.size());
  options.zeros = static_cast<int>(plant.zeros.size());
  for (const auto pole : plant.poles) options.origin += pole == 0.0 ? 1 : 0;
  options.delay = delay;
  if (delay == Delay::known) options.delay_s = plant.delay_s;
  return options;
}

std::string refusal(const Response& response, const FitOptions& options) {
  try {
    fit_maximum_likelihood(response, options);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(MaximumLikelihood, RecoversTheConstantsOfAGimbalFromExactData) {
  const ZerosPolesGain plant = gimbal_b();
  const Fit fit =
      fit_maximum_likelihood(exact_response(plant, gimbal_grid()), options_for(plant, Delay::fit));
  EXPECT_TRUE(fit.converged);
  EXPECT_LT(gain_error(fit.zpk, plant, gimbal_grid()).max_db, 1e-10);
  EXPECT_NEAR(fit.delay_s.value, 1.5e-3, 1e-12);
  EXPECT_NEAR(fit.static_gain.value, 20.0, 1e-9);
  ASSERT_EQ(fit.modes.size(), 4U);
  EXPECT_NEAR(fit.modes[1].frequency_hz.value, 23.0, 1e-9);
  EXPECT_NEAR(fit.modes[1].damping.value, 0.01, 1e-10);
  EXPECT_NEAR(fit.modes[2].frequency_hz.value, 90.0, 1e-9);
}

TEST(MaximumLikelihood, IsExactAtOrder26OverFourDecades) {
  Random random(5);
  const ZerosPolesGain plant = wide_plant(13, random);
  const Fit fit =
      fit_maximum_likelihood(exact_response(plant, wide_grid()), options_for(plant, Delay::none));
  EXPECT_LT(gain_error(fit.zpk, plant, wide_grid()).max_db, 1e-11);
}

TEST(MaximumLikelihood, FindsRandomGimbalsWithUnknownDelay) {
  Random random(11);
  int within = 0;
  constexpr int runs = 40;
  for (int run = 0; run < runs; ++run) {
    const RandomGimbal<Random> gimbal(random);
    const Response response = noisy_response(gimbal.plant, gimbal_grid(), 0.01, random);
    const Fit fit = fit_maximum_likelihood(response, options_for(gimbal.plant, Delay::fit));
    const double bound = crlb_db(0.01, fit.free_parameters, 100);
    within += gain_error(fit.zpk, gimbal.plant, gimbal_grid()).rms_db <= 2.0 * bound ? 1 : 0;
  }
  EXPECT_GE(within, runs - 1);
}

TEST(MaximumLikelihood, LeavesNoiseThatChiSquareExplains) {
  Random random(2);
  const Response response = noisy_response(gimbal_b(), gimbal_grid(), 0.01, random);
  const Fit fit = fit_maximum_likelihood(response, options_for(gimbal_b(), Delay::fit));
  EXPECT_EQ(fit.free_parameters, 13 - 1);
  EXPECT_EQ(fit.degrees_of_freedom, 188);
  EXPECT_GT(fit.chi2, fit.chi2_low * 0.9);
  EXPECT_LT(fit.chi2, fit.chi2_high * 1.1);
  EXPECT_TRUE(fit.outliers.empty());
  EXPECT_EQ(fit.num_standard_error.size(), 5U);
  EXPECT_EQ(fit.den_standard_error.size(), 8U);
  EXPECT_EQ(fit.den_standard_error[0], 0.0);
}

// The covariance of coefficients and that of the response are two routes to the same error bar.
TEST(MaximumLikelihood, CarriesOneCovarianceToCoefficientsAndResponse) {
  Random random(4);
  const ZerosPolesGain plant = to_zeros_poles_gain(choe_example_3());
  const Response response = noisy_response(plant, choe_grid(), 0.01, random);
  const Fit fit = fit_maximum_likelihood(response, options_for(plant, Delay::none));
  const double omega = 30.0;
  const Complex s{0.0, omega};
  const Complex G = fit.model.at(omega);
  Complex den = 0.0;
  for (const double c : fit.model.den) den = den * s + c;
  Eigen::RowVectorXcd row = Eigen::RowVectorXcd::Zero(fit.covariance.rows());
  row[0] = G / fit.model.num[0];
  for (int i = 0; i < 4; ++i) row[1 + i] = -G / den * std::pow(s, 3 - i);
  const double variance_re = row.real() * fit.covariance * row.real().transpose();
  EXPECT_NEAR(variance_re / fit.response(omega).variance_re, 1.0, 1e-6);
}

TEST(MaximumLikelihood, NamesGrossOutliersAndFitsTheRest) {
  Random random(6);
  Response response = noisy_response(gimbal_b(), gimbal_grid(), 0.01, random);
  for (const std::size_t i : {20U, 55U, 80U}) response[i].response *= Complex(2.0, 1.0);
  const Fit fit = fit_maximum_likelihood(response, options_for(gimbal_b(), Delay::fit));
  EXPECT_THAT(fit.outliers, testing::ElementsAre(20U, 55U, 80U));
  EXPECT_LT(gain_error(fit.zpk, gimbal_b(), gimbal_grid()).rms_db, 0.05);
}

TEST(MaximumLikelihood, GivesTheContinuousPlantBehindHoldAndPath) {
  const double period_s = 1e-3;
  ZerosPolesGain with_path = gimbal_b();
  with_path.delay_s += 0.7e-3;
  const auto grid = gimbal_grid();
  const Eigen::ArrayXd omega = Eigen::Map<const Eigen::ArrayXd>(grid.data(), 100);
  const Eigen::ArrayXcd H = held_response(with_path, period_s, omega);
  Response response;
  for (Eigen::Index i = 0; i < 100; ++i) response.push_back({omega[i], H[i], 0, 0, 0});
  FitOptions options = options_for(gimbal_b(), Delay::fit);
  options.hold_period_s = period_s;
  options.path_delay_s = 0.7e-3;
  const Fit fit = fit_maximum_likelihood(response, options);
  EXPECT_LT(gain_error(fit.zpk, gimbal_b(), grid).max_db, 1e-6);
  EXPECT_NEAR(fit.delay_s.value, 1.5e-3, 1e-9);
}

// The images of the hold are no outliers, and do not hide those that are.
TEST(MaximumLikelihood, JudgesPointsByTheModelBehindItsHold) {
  const double period_s = 1e-3;
  int number = 0;
  for (const ZerosPolesGain& plant : plain_plants()) {
    ++number;
    for (const double top_hz : {150.0, 200.0, 400.0}) {
      const auto grid = log_grid(2.0 * std::numbers::pi * 0.5, 2.0 * std::numbers::pi * top_hz, 60);
      for (unsigned seed = 1; seed <= 4; ++seed) {
        SCOPED_TRACE("plant " + std::to_string(number) + " to " + std::to_string(top_hz) +
                     " Hz, seed " + std::to_string(seed));
        Random random(seed);
        Response response = noisy_behind_hold(plant, period_s, grid, 1e-3, random);
        FitOptions options = options_for(plant, Delay::fit);
        options.hold_period_s = period_s;
        const Fit fit = fit_maximum_likelihood(response, options);
        EXPECT_THAT(fit.outliers, testing::IsEmpty());
        for (const std::size_t i : {20U, 50U}) response[i].response *= Complex(1.1, 0.1);
        const Fit with_outliers = fit_maximum_likelihood(response, options);
        EXPECT_THAT(with_outliers.outliers, testing::ElementsAre(20U, 50U));
        EXPECT_LT(gain_error(with_outliers.zpk, plant, grid).rms_db, 0.01);
      }
    }
  }
}

// One order too many behind a hold: of what was measured, the response at the ticks, the fit knows
// no less than the point does, whatever it says of the roots. (Of the response between the ticks it
// may know less, and rightly so: of roots above half the rate the ticks see only an image.)
TEST(MaximumLikelihood, KnowsTheResponseAtAPointAtLeastAsWellAsThePoint) {
  const double period_s = 1e-3;
  const auto grid = log_grid(2.0 * std::numbers::pi * 0.5, 2.0 * std::numbers::pi * 150.0, 40);
  const ZerosPolesGain lag{{}, {-4.0 * std::numbers::pi}, 200.0 * std::numbers::pi, 2e-3};
  int judged = 0;
  for (const auto& [zeros, poles] : {std::pair{0, 1}, {0, 2}, {1, 2}, {1, 3}})
    for (unsigned seed = 1; seed <= 4; ++seed) {
      Random random(seed);
      const Response response = noisy_behind_hold(lag, period_s, grid, 0.003, random);
      FitOptions options;
      options.zeros = zeros;
      options.poles = poles;
      options.delay = Delay::fit;
      options.hold_period_s = period_s;
      const Fit fit = fit_maximum_likelihood(response, options);
      if (fit.condition > 1e5) continue;
      ++judged;
      for (const std::size_t i : {5U, 20U, 30U, 39U}) {
        const ResponsePoint& point = response[i];
        const auto held = [&](const ZerosPolesGain& model) {
          const Complex H =
              held_response(model, period_s, Eigen::ArrayXd::Constant(1, point.omega_rad_s))[0];
          return std::vector<double>{H.real(), H.imag()};
        };
        const std::vector<double> error = standard_errors(fit.zpk, fit.root_covariance, held);
        EXPECT_LE(error[0] * error[0] + error[1] * error[1],
                  1.1 * (point.variance_re + point.variance_im))
            << zeros << '/' << poles << " seed " << seed << " point " << i;
      }
    }
  EXPECT_GT(judged, 8);
}

// Without scatter a search that ends short of the minimum leaves residuals that stand out; they are
// no outliers, and to leave their points out makes the fit worse.
TEST(MaximumLikelihood, KeepsGoodPointsWithoutKnowingTheScatter) {
  const double turn = 2.0 * std::numbers::pi;
  const auto pair = [&](Complex s, double frequency_hz) {
    const Complex x = s / (turn * frequency_hz);
    return 1.0 / (x * x + 0.02 * x + 1.0);
  };
  const auto close_pair = [&](Complex s) {
    return pair(s, 10.0) + pair(s, 10.3);
  };
  const auto leads = [&](Complex s) {
    const Complex lead = 1.0 + s / (turn * 3.0);
    const Complex lag = 1.0 + s / (turn * 200.0);
    return lead * lead / (lag * lag * s);
  };
  const auto fit_of = [](const auto& plant, const std::vector<double>& grid, FitOptions options,
                         unsigned seed) {
    Random random(seed);
    std::normal_distribution<double> normal(0.0, 0.01);
    Response response;
    for (const double omega : grid) {
      const double re = normal(random);
      const double im = normal(random);
      response.push_back({omega, plant(Complex{0.0, omega}) * Complex{1.0 + re, im}, 0, 0, 0});
    }
    return fit_maximum_likelihood(response, options);
  };
  FitOptions options;
  options.delay = Delay::fit;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    options.poles = 4;
    options.zeros = 2;
    options.origin = 0;
    const Fit pair_fit = fit_of(close_pair, log_grid(turn, turn * 100.0, 100), options, seed);
    EXPECT_THAT(pair_fit.outliers, testing::IsEmpty()) << "close pair, seed " << seed;
    options.poles = 3;
    options.origin = 1;
    const Fit lead_fit = fit_of(leads, log_grid(turn * 0.1, turn * 300.0, 60), options, seed);
    EXPECT_THAT(lead_fit.outliers, testing::IsEmpty()) << "leads, seed " << seed;
  }
}

TEST(MaximumLikelihood, FindsOutliersWithoutKnowingTheScatter) {
  Random random(6);
  Response response = noisy_response(gimbal_b(), gimbal_grid(), 0.01, random);
  for (const std::size_t i : {20U, 55U, 80U}) response[i].response *= Complex(2.0, 1.0);
  for (ResponsePoint& point : response) point.variance_re = point.variance_im = 0.0;
  const Fit fit = fit_maximum_likelihood(response, options_for(gimbal_b(), Delay::fit));
  EXPECT_THAT(fit.outliers, testing::ElementsAre(20U, 55U, 80U));
  EXPECT_LT(gain_error(fit.zpk, gimbal_b(), gimbal_grid()).rms_db, 0.05);
}

TEST(MaximumLikelihood, KeepsWhatIsFixed) {
  Random random(8);
  const Response response = noisy_response(gimbal_b(), gimbal_grid(), 0.01, random);
  FitOptions options = options_for(gimbal_b(), Delay::known);
  options.static_gain = 20.0;
  options.given_poles = {-2.0 * std::numbers::pi * 0.8};
  const Fit fit = fit_maximum_likelihood(response, options);
  EXPECT_EQ(fit.free_parameters, 9);
  EXPECT_NEAR(fit.static_gain.value, 20.0, 1e-9);
  EXPECT_LT(fit.static_gain.standard_error, 1e-6);
  EXPECT_EQ(fit.zpk.delay_s, 1.5e-3);
  EXPECT_EQ(fit.zpk.poles[1], options.given_poles[0]);
  EXPECT_LT(gain_error(fit.zpk, gimbal_b(), gimbal_grid()).rms_db, 0.05);
}

TEST(MaximumLikelihood, KeepsPolesAndZerosInTheLeftHalfPlaneWhenAsked) {
  ZerosPolesGain plant{{}, {}, 1.0, 0.0};
  add_pair(plant.poles, 20.0, -0.02);
  add_pair(plant.zeros, 30.0, -0.02);
  Random random(9);
  const Response response = noisy_response(plant, gimbal_grid(), 0.01, random);
  FitOptions options = options_for(plant, Delay::none);
  const Fit unstable = fit_maximum_likelihood(response, options);
  EXPECT_GT(unstable.zpk.poles[0].real(), 0.0);
  options.stable = options.minimum_phase = true;
  const Fit stable = fit_maximum_likelihood(response, options);
  for (const auto pole : stable.zpk.poles) EXPECT_LT(pole.real(), 0.0);
  for (const auto zero : stable.zpk.zeros) EXPECT_LT(zero.real(), 0.0);
  EXPECT_GT(stable.chi2, unstable.chi2);
}

TEST(MaximumLikelihood, FitsADelayNeverWorseThanNone) {
  Random random(10);
  for (int run = 0; run < 10; ++run) {
    const RandomGimbal<Random> gimbal(random);
    const Response response = noisy_response(gimbal.plant, gimbal_grid(), 0.01, random);
    FitOptions options = options_for(gimbal.plant, Delay::none);
    options.poles -= 2;
    options.zeros -= 2;
    options.robust = false;
    const double without = fit_maximum_likelihood(response, options).chi2;
    options.delay = Delay::fit;
    EXPECT_LE(fit_maximum_likelihood(response, options).chi2, without * 1.01);
  }
}

TEST(MaximumLikelihood, AnswersDegeneratePlants) {
  const auto grid = log_grid(1.0, 100.0, 30);
  const auto error_of = [&](const ZerosPolesGain& plant, Delay delay) {
    const Fit fit = fit_maximum_likelihood(exact_response(plant, grid), options_for(plant, delay));
    return gain_error(fit.zpk, plant, grid).max_db;
  };
  EXPECT_LT(error_of({{}, {}, 7.0, 0.0}, Delay::none), 1e-10) << "pure gain";
  EXPECT_LT(error_of({{}, {}, 7.0, 0.02}, Delay::fit), 1e-10) << "pure delay";
  EXPECT_LT(error_of({{5.0}, {-5.0}, 1.0, 0.0}, Delay::none), 1e-10) << "all-pass";
  EXPECT_LT(error_of({{}, {-5.0, -5.0}, 1.0, 0.0}, Delay::none), 1e-8) << "double pole";
  EXPECT_LT(error_of({{}, {0.0, 0.0}, 3.0, 0.0}, Delay::none), 1e-10) << "double integrator";
  EXPECT_LT(error_of({{0.0}, {-5.0}, 3.0, 0.0}, Delay::none), 1e-8) << "zero at the origin";
  for (const double gain : {1e-12, 1e12})
    EXPECT_LT(error_of({{}, {-5.0}, gain, 0.0}, Delay::none), 1e-10) << gain;
  const Complex on_grid{-1e-9, grid[10]};
  EXPECT_LT(error_of({{}, {on_grid, std::conj(on_grid)}, 3.0, 0.0}, Delay::none), 1e-4);
}

TEST(MaximumLikelihood, RefusesTheImpossibleAndSaysWhatToDo) {
  const Response response = exact_response(gimbal_b(), gimbal_grid());
  FitOptions options = options_for(gimbal_b(), Delay::fit);
  EXPECT_THAT(refusal({response.begin(), response.begin() + 2}, options),
              HasSubstr("2 points, but the model asked for needs at least 6"));
  options.origin = 8;
  EXPECT_THAT(refusal(response, options), HasSubstr("raise poles"));
  options = options_for(gimbal_b(), Delay::fit);
  options.given_poles = {{-1.0, 2.0}};
  EXPECT_THAT(refusal(response, options), HasSubstr("conjugate pairs"));
  options.given_poles.clear();
  options.hold_period_s = 0.01;
  EXPECT_THAT(refusal(response, options), HasSubstr("half the rate"));
  options.hold_period_s = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal(response, options), HasSubstr("not finite"));
}

TEST(MaximumLikelihood, AnOrderFarTooHighEndsWithoutConvergenceOrWithHugeErrors) {
  Random random(12);
  const Response response = noisy_response(choe_example_3(), choe_grid(), 0.01, random);
  FitOptions options;
  options.poles = 14;
  options.zeros = 13;
  const Fit fit = fit_maximum_likelihood(response, options);
  EXPECT_TRUE(std::isfinite(fit.chi2));
  EXPECT_FALSE(fit.reason.empty());
}

// Nothing is left to fit; the command line once crashed on it.
TEST(MaximumLikelihood, TakesAModelThatIsGivenWhole) {
  FitOptions options;
  options.poles = 1;
  options.origin = 1;
  options.static_gain = 2.0;
  const Fit fit = fit_maximum_likelihood(
      exact_response(ZerosPolesGain{{}, {0.0}, 2.0, 0.0}, log_grid(1.0, 100.0, 10)), options);
  EXPECT_EQ(fit.free_parameters, 0);
  EXPECT_TRUE(fit.converged);
  EXPECT_NEAR(fit.model.num.front(), 2.0, 1e-12);
}

}  // namespace
}  // namespace sinerig::identify
