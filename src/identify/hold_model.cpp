#include "identify/hold_model.h"

#include <cmath>

#include "identify/hold.h"

namespace sinerig::identify {

ZerosPolesGain compose(const OrthonormalBasis& N_basis, const Eigen::VectorXd& n,
                       const OrthonormalBasis& D_basis, const Eigen::VectorXd& d, double scale,
                       double delay_s, const ZerosPolesGain& fixed) {
  ZerosPolesGain zpk = fixed;
  zpk.delay_s += delay_s;
  for (const auto root : N_basis.roots(n)) zpk.zeros.push_back(root * scale);
  for (const auto root : D_basis.roots(d)) zpk.poles.push_back(root * scale);
  const int m = N_basis.degree();
  const int poles = D_basis.degree();
  const double n_leading = OrthonormalBasis::significant_leading(n);
  const double d_leading = OrthonormalBasis::significant_leading(d);
  const double log_gain = std::log(std::abs(n_leading)) + N_basis.log_leading(m) -
                          std::log(std::abs(d_leading)) - D_basis.log_leading(poles) +
                          (poles - m) * std::log(scale);
  zpk.gain *= std::copysign(std::exp(log_gain), n_leading * d_leading);
  return zpk;
}

Eigen::ArrayXcd HoldModel::response(const OrthonormalBasis& N_basis, const Eigen::VectorXd& n,
                                    const OrthonormalBasis& D_basis, const Eigen::VectorXd& d,
                                    double delay_s, const FitData& data) const {
  return held_response(compose(N_basis, n, D_basis, d, data.scale, delay_s, fixed_), period_s_,
                       data.omega);
}

}  // namespace sinerig::identify
