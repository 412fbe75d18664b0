#include "identify/root_covariance.h"

#include <functional>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "identify/discrete.h"
#include "identify/maximum_likelihood.h"
#include "identify/modal_form.h"
#include "identify/sections.h"
#include "plants.h"

namespace sinerig::identify {
namespace {

using namespace test;

FitOptions gimbal_options() {
  FitOptions options;
  options.poles = 7;
  options.zeros = 4;
  options.origin = 1;
  options.delay = Delay::fit;
  return options;
}

Fit gimbal_fit(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  return fit_maximum_likelihood(noisy_response(gimbal_b(), gimbal_grid(), 0.01, random),
                                gimbal_options());
}

// The other way round: the covariance in the bases of the fit.
TEST(RootCovariance, GivesTheBandThatTheFitGives) {
  const Fit fit = gimbal_fit(1);
  for (const double omega : {0.3, 5.0, 113.0, 144.5, 470.0, 3000.0}) {
    const ResponsePoint direct = fit.response(omega);
    const ResponsePoint through_roots =
        response_with_covariance(fit.zpk, fit.root_covariance, omega);
    EXPECT_NEAR(through_roots.variance_re / direct.variance_re, 1.0, 1e-5) << omega;
    EXPECT_NEAR(through_roots.variance_im / direct.variance_im, 1.0, 1e-5) << omega;
    EXPECT_NEAR(through_roots.covariance, direct.covariance,
                1e-5 * std::sqrt(direct.variance_re * direct.variance_im));
  }
}

// Two coordinates that cancel in the response but for less than the rounding of their variances.
TEST(RootCovariance, SaysSoWhereTheBandIsBelowItsRounding) {
  const ZerosPolesGain lag{{}, {-1.0}, 1.0, 0.0};
  RootCovariance covariance{1.0, Eigen::MatrixXd::Zero(3, 3)};
  EXPECT_EQ(response_with_covariance(lag, covariance, 0.5).variance_re, 0.0);
  covariance.covariance(1, 1) = 1e-6;
  const ResponsePoint known = response_with_covariance(lag, covariance, 0.5);
  EXPECT_NEAR(known.variance_re + known.variance_im, 1e-6 * std::norm(known.response), 1e-18);
  covariance.covariance(2, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(response_with_covariance(lag, covariance, 0.5).variance_re));
  // d ln G = −dp/(s − p)·… of the pole against a gain and a delay that undo it at one frequency.
  const double omega = 0.5;
  const std::complex<double> by_pole =
      1.0 / std::complex<double>{1.0, omega} - (1.0 / std::complex<double>{1.0, 1.0}).real();
  const Eigen::Vector3d undone =
      1e8 * Eigen::Vector3d{1.0, -by_pole.real(), by_pole.imag() / omega};
  covariance.covariance = undone * undone.transpose();
  EXPECT_TRUE(std::isnan(response_with_covariance(lag, covariance, omega).variance_re));
  EXPECT_FALSE(std::isnan(response_with_covariance(lag, covariance, 5.0).variance_re));
}

TEST(RootCovariance, CarriesTheErrorsOfCoefficientsOver) {
  const Fit fit = gimbal_fit(2);
  const auto coefficients = [](const ZerosPolesGain& model) {
    const TransferFunction function = to_transfer_function(model);
    std::vector<double> all = function.num;
    all.insert(all.end(), function.den.begin(), function.den.end());
    return all;
  };
  const std::vector<double> errors = standard_errors(fit.zpk, fit.root_covariance, coefficients);
  std::vector<double> wanted = fit.num_standard_error;
  wanted.insert(wanted.end(), fit.den_standard_error.begin(), fit.den_standard_error.end());
  ASSERT_EQ(errors.size(), wanted.size());
  for (std::size_t i = 0; i < errors.size(); ++i)
    EXPECT_NEAR(errors[i], wanted[i], 1e-4 * wanted[i]) << i;
}

TEST(RootCovariance, MovesConjugatesTogetherAndKeepsTheGainInsideTheBand) {
  const ZerosPolesGain plant = gimbal_b();
  Eigen::VectorXd step = Eigen::VectorXd::Zero(coordinates_of(plant));
  ASSERT_EQ(step.size(), 7 + 4 + 2);
  step[3] = 0.5;  // the real part of the first pole pair
  const ZerosPolesGain other = moved(plant, 60.0, step);
  EXPECT_EQ(other.poles[3], plant.poles[3] + 0.5);
  EXPECT_EQ(other.poles[4], std::conj(other.poles[3]));
  EXPECT_NEAR(std::abs(other.at(60.0) / plant.at(60.0)), 1.0, 1e-12);
  EXPECT_THROW(response_with_covariance(plant, {60.0, Eigen::MatrixXd(3, 3)}, 1.0),
               std::invalid_argument);
}

TEST(RootCovariance, SaysSoWhereAQuantityDoesNotExistOnBothSides) {
  const Fit fit = gimbal_fit(3);
  const double damping = -fit.zpk.poles[3].real();
  const auto only_here = [&](const ZerosPolesGain& model) {
    if (-model.poles[3].real() > damping) throw std::invalid_argument("no");
    return std::vector<double>{1.0};
  };
  EXPECT_TRUE(std::isnan(standard_errors(fit.zpk, fit.root_covariance, only_here).front()));
}

// The errors of derived forms are right when they predict how these scatter over many fits.
TEST(RootCovariance, PredictsTheScatterOfSectionsStateSpaceAndDiscreteForms) {
  const auto numbers = [](const ZerosPolesGain& model) {
    constexpr double period_s = 1.3e-3;  // the delay is far from where its whole ticks change
    std::vector<double> all = tustin(model, period_s, 60.0).num();
    for (const auto& more :
         {hold_equivalent(model, period_s).den(), matched(model, period_s).num()})
      all.insert(all.end(), more.begin(), more.end());
    for (const Section& section : second_order_sections(model))
      all.insert(all.end(), section.den.begin(), section.den.end());
    const StateSpace system = to_modal_form(model);
    all.insert(all.end(), system.B.begin(), system.B.end());
    all.insert(all.end(), system.C.begin(), system.C.end());
    return all;
  };
  // Sections stand in the order of their damping, which must not be a tie.
  ZerosPolesGain plant = gimbal_b();
  plant.poles.resize(5);
  add_pair(plant.poles, 90.0, 0.02);
  const std::vector<double> truth = numbers(plant);
  int inside = 0;
  int total = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    std::mt19937_64 random(seed);
    const Fit fit = fit_maximum_likelihood(noisy_response(plant, gimbal_grid(), 0.01, random),
                                           gimbal_options());
    const std::vector<double> values = numbers(fit.zpk);
    const std::vector<double> errors = standard_errors(fit.zpk, fit.root_covariance, numbers);
    ASSERT_EQ(values.size(), truth.size());
    for (std::size_t i = 0; i < truth.size(); ++i) {
      if (errors[i] <= 1e-9 * std::abs(truth[i])) continue;  // fixed: a leading 1, the integrator
      inside += std::abs(values[i] - truth[i]) <= 1.959964 * errors[i] ? 1 : 0;
      ++total;
    }
  }
  EXPECT_GT(total, 60 * 40);
  EXPECT_GT(100.0 * inside / total, 92.0);
  EXPECT_LT(100.0 * inside / total, 98.0);
}

}  // namespace
}  // namespace sinerig::identify
