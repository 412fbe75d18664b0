#include "identify/loop_model.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace sinerig::identify {

namespace {

using Complex = std::complex<double>;

constexpr double pi = std::numbers::pi;
constexpr double below_half = 1.0 - 1e-6;  // of the rate: as near as the search goes
constexpr double least_step_rad = 0.5;     // of the argument, between two frequencies

double slowest_and_fastest(const std::vector<Complex>& roots, bool fastest) {
  double found = 0.0;
  for (const Complex root : roots) {
    const double omega = std::abs(root);
    if (omega == 0.0) continue;
    found = found == 0.0 ? omega : (fastest ? std::max(found, omega) : std::min(found, omega));
  }
  return found == 0.0 ? 1.0 : found;
}

template <typename F>
double turned(const F& f, double low, Complex at_low, double high, Complex at_high, int depth) {
  const double direct = std::arg(at_high / at_low);
  if (depth == 0 || !std::isfinite(direct) || (std::abs(direct) < least_step_rad && depth < 38))
    return direct;
  const double middle = std::sqrt(low * high);
  const Complex at_middle = f(middle);
  return turned(f, low, at_low, middle, at_middle, depth - 1) +
         turned(f, middle, at_middle, high, at_high, depth - 1);
}

}  // namespace

ZerosPolesGain pid(double kp, double ki, double kd, double filter_rad_s) {
  const double lag = filter_rad_s > 0.0 ? 1.0 / filter_rad_s : 0.0;
  TransferFunction C{{kp * lag + kd, kp + ki * lag, ki}, {lag, 1.0, 0.0}, 0.0};
  if (ki == 0.0) {
    C.num.pop_back();
    C.den.pop_back();
  }
  return to_zeros_poles_gain(C);
}

LoopModel::LoopModel(ZerosPolesGain plant, ZerosPolesGain controller, double rate_hz)
    : plant_(std::move(plant)), controller_(std::move(controller)), rate_hz_(rate_hz) {
  if (rate_hz <= 0.0) return;
  if (controller_.zeros.size() > controller_.poles.size())
    throw std::invalid_argument(
        "loop: the controller has more zeros than poles and cannot run at a rate; filter its "
        "derivative");
  held_ = zero_order_hold(to_state_space(plant_), 1.0 / rate_hz);
}

LoopModel LoopModel::with(const Notch& notch) const {
  LoopModel more = *this;
  more.notches_.push_back(notch);
  return more;
}

Complex LoopModel::at(double omega_rad_s) const {
  Complex L;
  if (rate_hz_ > 0.0) {
    const Complex s{0.0, 2.0 * rate_hz_ * std::tan(0.5 * omega_rad_s / rate_hz_)};
    const Complex delay = std::polar(1.0, -omega_rad_s * controller_.delay_s);
    ZerosPolesGain C = controller_;
    C.delay_s = 0.0;
    L = held_->at(omega_rad_s) * C.at(s) * delay;
  } else {
    L = plant_.at(omega_rad_s) * controller_.at(omega_rad_s);
  }
  for (const Notch& notch : notches_) L *= notch.at(omega_rad_s);
  return L;
}

std::vector<Complex> LoopModel::open_loop_roots() const {
  std::vector<Complex> roots;
  const auto add = [&](const ZerosPolesGain& part) {
    roots.insert(roots.end(), part.zeros.begin(), part.zeros.end());
    roots.insert(roots.end(), part.poles.begin(), part.poles.end());
  };
  add(plant_);
  add(controller_);
  for (const Notch& notch : notches_) add(notch.zpk());
  return roots;
}

// (1 + L)·∏(q − p)/(q − p*), q = jω, or exp(jωT) where sampled.
Complex LoopModel::moved(double omega_rad_s) const {
  Complex value = 1.0 + at(omega_rad_s);
  const bool sampled = rate_hz_ > 0.0;
  const double period = sampled ? 1.0 / rate_hz_ : 0.0;
  const Complex q = sampled ? std::polar(1.0, omega_rad_s * period) : Complex{0.0, omega_rad_s};
  const double slow = slowest_and_fastest(open_loop_roots(), false);
  const auto move = [&](Complex pole, bool by_tustin) {
    if (pole.real() < -1e-12 * std::abs(pole)) return;
    const double away = std::max(pole.real(), 0.1 * (pole == 0.0 ? slow : std::abs(pole)));
    const Complex star{-away, pole.imag()};
    const auto place = [&](Complex s) {
      if (!sampled) return s;
      return by_tustin ? (1.0 + 0.5 * period * s) / (1.0 - 0.5 * period * s) : std::exp(s * period);
    };
    value *= (q - place(pole)) / (q - place(star));
  };
  for (const Complex pole : plant_.poles) move(pole, false);
  for (const Complex pole : controller_.poles) move(pole, true);
  return value;
}

double LoopModel::highest_rad_s() const {
  return rate_hz_ > 0.0 ? pi * rate_hz_ * below_half
                        : 1e3 * slowest_and_fastest(open_loop_roots(), true);
}

bool LoopModel::closed_loop_stable() const {
  const std::vector<Complex> roots = open_loop_roots();
  const double first = 1e-3 * slowest_and_fastest(roots, false);
  const double last = highest_rad_s();
  const std::vector<double> grid = model_grid(std::min(first, 0.1 * last), last, roots);
  const auto F = [this](double omega) {
    return moved(omega);
  };
  Complex here = F(grid.front());
  // Up to the first frequency the argument comes from a real value.
  double turn = std::arg(here.real() < 0.0 ? -here : here);
  for (std::size_t i = 1; i < grid.size(); ++i) {
    const Complex next = F(grid[i]);
    turn += turned(F, grid[i - 1], here, grid[i], next, 40);
    here = next;
  }
  return std::lround(-turn / pi) == 0;
}

Curve LoopModel::curve(double first_rad_s, double last_rad_s, const Curve::Scatter& scatter) const {
  double last = last_rad_s;
  std::vector<double> real_ends;
  const std::vector<Complex> roots = open_loop_roots();
  if (std::none_of(roots.begin(), roots.end(), [](Complex root) { return root == 0.0; }))
    real_ends.push_back(0.0);
  if (rate_hz_ > 0.0 && last >= pi * rate_hz_ * below_half) {
    last = pi * rate_hz_ * below_half;
    real_ends.push_back(pi * rate_hz_);
  }
  return Curve::of_model([loop = *this](double omega) { return loop.at(omega); }, scatter,
                         model_grid(first_rad_s, last, roots))
      .with_real_ends(real_ends);
}

}  // namespace sinerig::identify
