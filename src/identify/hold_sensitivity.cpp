// d H / d (n, d, delay) of G = K·N/D behind a hold, K what is not fitted and the step 1/s: by n_k
// it is the response of K·P_k/D, by d_k that of −K·N·Q_k/D², by the delay that of −s·K·N/D, each
// summed over the ticks from its partial fractions.
#include <algorithm>
#include <cmath>

#include "identify/hold_model.h"
#include "identify/sampled_terms.h"

namespace sinerig::identify {

namespace {

using Complex = std::complex<double>;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

// Distance of two poles, over their size or the first frequency, of which the power that the
// partial fractions grow with leaves half of the digits: the third, of an order more at the origin
// each one.
constexpr double half_of_the_digits = 1e-9;

// First terms of a Taylor series at the origin.
using Series = std::vector<Complex>;

Series times(const Series& a, const Series& b) {
  Series product(a.size(), 0.0);
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t k = 0; k + i < a.size(); ++k) product[i + k] += a[i] * b[k];
  return product;
}

void divide_by(Series& series, Complex root) {
  for (std::size_t i = 0; i < series.size(); ++i)
    series[i] = (series[i] - (i > 0 ? series[i - 1] : 0.0)) / -root;
}

// In scaled s, where everything is of size one.
struct Parts {
  std::vector<Complex> poles;  // of D
  std::vector<Complex> given;  // of K, away from the origin
  double leading;              // of D
  double gain;                 // of K
  int at_origin;               // poles of K there, that of the step among them

  Parts(const OrthonormalBasis& D_basis, const VectorXd& d, double scale,
        const ZerosPolesGain& fixed)
      : poles(D_basis.roots(d)),
        leading(OrthonormalBasis::significant_leading(d) *
                std::exp(D_basis.log_leading(D_basis.degree()))),
        gain(fixed.gain),
        at_origin(1 - static_cast<int>(fixed.zeros.size())) {
    for (const Complex pole : fixed.poles) {
      if (pole == 0.0)
        ++at_origin;
      else
        given.push_back(pole / scale);
    }
    gain *= std::pow(
        scale, static_cast<double>(fixed.zeros.size()) - static_cast<double>(fixed.poles.size()));
  }

  bool apart(double first) const {
    std::vector<Complex> all = poles;
    all.insert(all.end(), given.begin(), given.end());
    const double between_two = std::pow(half_of_the_digits, 1.0 / 3.0);
    const double to_origin =
        at_origin > 0 ? std::pow(half_of_the_digits, 1.0 / (at_origin + 2)) * first : 0.0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (!(std::abs(all[i]) >= to_origin)) return false;
      for (std::size_t k = 0; k < i; ++k) {
        const double size = std::max({std::abs(all[i]), std::abs(all[k]), first});
        if (!(std::abs(all[i] - all[k]) >= between_two * size)) return false;
      }
    }
    return true;
  }

  // K without the given pole left_out.
  Complex K(Complex s, std::size_t left_out) const {
    Complex value = gain / std::pow(s, at_origin);
    for (std::size_t q = 0; q < given.size(); ++q)
      if (q != left_out) value /= s - given[q];
    return value;
  }
  Complex K(Complex s) const { return K(s, given.size()); }

  // D without its root left_out: at that root the derivative of D.
  Complex D(Complex s, std::size_t left_out) const {
    Complex value = leading;
    for (std::size_t i = 0; i < poles.size(); ++i)
      if (i != left_out) value *= s - poles[i];
    return value;
  }
  Complex D(Complex s) const { return D(s, poles.size()); }

  // d ln of K over (D without root p) squared, at that root.
  Complex log_slope(std::size_t p) const {
    const Complex s = poles[p];
    Complex slope = -static_cast<double>(at_origin) / s;
    for (const Complex pole : given) slope -= 1.0 / (s - pole);
    for (std::size_t i = 0; i < poles.size(); ++i)
      if (i != p) slope -= 2.0 / (s - poles[i]);
    return slope;
  }

  // Of K/D without the poles at the origin.
  Series series() const {
    Series series(static_cast<std::size_t>(std::max(at_origin, 0)), 0.0);
    if (series.empty()) return series;
    series[0] = gain / leading;
    for (const Complex pole : given) divide_by(series, pole);
    for (const Complex pole : poles) divide_by(series, pole);
    return series;
  }
  Series over_D(Series series) const {
    for (Complex& each : series) each /= leading;
    for (const Complex pole : poles) divide_by(series, pole);
    return series;
  }
};

std::vector<Series> series_of(const OrthonormalBasis& basis, std::size_t terms) {
  const Eigen::MatrixXd powers = basis.power_coefficients();
  std::vector<Series> all(static_cast<std::size_t>(powers.rows()), Series(terms, 0.0));
  for (Index k = 0; k < powers.rows(); ++k)
    for (Index i = 0; i < std::min(powers.cols(), static_cast<Index>(terms)); ++i)
      all[static_cast<std::size_t>(k)][static_cast<std::size_t>(i)] = powers(k, i);
  return all;
}

// What the partial fractions are multiplied with, one column per parameter. Rows: the poles of D,
// the same squared, the given poles, t^q/q! from the highest q down.
MatrixXcd partial_fractions(const Parts& parts, const OrthonormalBasis& N_basis, const VectorXd& n,
                            const OrthonormalBasis& D_basis) {
  const auto fitted = static_cast<Index>(parts.poles.size());
  const auto given = static_cast<Index>(parts.given.size());
  const Series base = parts.series();
  const Index by_d = n.size();
  const Index last = n.size() + D_basis.degree() + 1;
  MatrixXcd rows = MatrixXcd::Zero(2 * fitted + given + static_cast<Index>(base.size()), last + 1);
  for (Index p = 0; p < fitted; ++p) {
    const Complex s = parts.poles[static_cast<std::size_t>(p)];
    const Complex slope = parts.D(s, static_cast<std::size_t>(p));
    const Complex over = parts.K(s) / slope;
    const Complex squared = -over / slope;
    const OrthonormalBasis::Value N = N_basis.at(n, s);
    const VectorXcd Q = D_basis.all_at(s);
    rows.row(p).head(by_d) = N_basis.all_at(s).transpose() * over;
    rows.row(p).segment(by_d, Q.size()) =
        (squared * (Q * (N.derivative + N.value * parts.log_slope(static_cast<std::size_t>(p))) +
                    D_basis.all_slopes_at(s) * N.value))
            .transpose();
    rows.row(fitted + p).segment(by_d, Q.size()) = Q.transpose() * (squared * N.value);
    rows(p, last) = -s * over * N.value;
  }
  for (Index q = 0; q < given; ++q) {
    const Complex s = parts.given[static_cast<std::size_t>(q)];
    const Complex D = parts.D(s);
    const Complex over = parts.K(s, static_cast<std::size_t>(q)) / D;
    const Complex N = N_basis.at(n, s).value;
    rows.row(2 * fitted + q).head(by_d) = N_basis.all_at(s).transpose() * over;
    rows.row(2 * fitted + q).segment(by_d, last - by_d) =
        D_basis.all_at(s).transpose() * (-over * N / D);
    rows(2 * fitted + q, last) = -s * over * N;
  }
  if (base.empty()) return rows;
  const Index origin = 2 * fitted + given;
  const auto put = [&](const Series& series, Index column) {
    for (std::size_t i = 0; i < series.size(); ++i)
      rows(origin + static_cast<Index>(i), column) = series[i];
  };
  Series N(base.size(), 0.0);
  const auto P = series_of(N_basis, base.size());
  for (std::size_t k = 0; k < P.size(); ++k) {
    put(times(base, P[k]), static_cast<Index>(k));
    for (std::size_t i = 0; i < N.size(); ++i) N[i] += n[static_cast<Index>(k)] * P[k][i];
  }
  const Series over = times(base, N);
  Series twice = parts.over_D(over);
  for (Complex& each : twice) each = -each;
  const auto Q = series_of(D_basis, base.size());
  for (std::size_t k = 0; k < Q.size(); ++k) put(times(twice, Q[k]), by_d + static_cast<Index>(k));
  Series by_delay(base.size(), 0.0);
  for (std::size_t i = 1; i < base.size(); ++i) by_delay[i] = -over[i - 1];
  put(by_delay, last);
  return rows;
}

}  // namespace

std::optional<MatrixXcd> HoldModel::sensitivity(const OrthonormalBasis& N_basis, const VectorXd& n,
                                                const OrthonormalBasis& D_basis, const VectorXd& d,
                                                double delay_s, const FitData& data) const {
  const Parts parts(D_basis, d, data.scale, fixed_);
  if (!parts.apart(data.x[0])) return {};
  const MatrixXcd fractions = partial_fractions(parts, N_basis, n, D_basis);
  const TickDelay delay(fixed_.delay_s + delay_s, period_s_);
  const double period = period_s_ * data.scale;
  const auto fitted = static_cast<Index>(parts.poles.size());
  const auto given = static_cast<Index>(parts.given.size());
  MatrixXcd terms(data.points(), fractions.rows());
  for (Index i = 0; i < data.points(); ++i) {
    const double angle = data.omega[i] * period_s_;
    const Complex z_inverse = std::polar(1.0, -angle);
    for (Index p = 0; p < fitted + given; ++p) {
      const bool free = p < fitted;
      const Complex pole = free ? parts.poles[static_cast<std::size_t>(p)]
                                : parts.given[static_cast<std::size_t>(p - fitted)];
      const auto sampled = sampled_exponential(pole, delay.fraction, period, z_inverse);
      terms(i, free ? p : fitted + p) = sampled.value;
      if (free) terms(i, fitted + p) = sampled.slope;
    }
    for (int q = 0; q < parts.at_origin; ++q)
      terms(i, fractions.rows() - 1 - q) = sampled_power(q, delay.fraction, period, z_inverse);
    terms.row(i) *= (1.0 - z_inverse) * std::polar(1.0, -angle * delay.whole_ticks);
  }
  MatrixXcd sensitivity = terms * fractions;
  if (!sensitivity.allFinite()) return {};
  return sensitivity;
}

}  // namespace sinerig::identify
