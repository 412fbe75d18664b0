#include "identify/sections.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace sinerig::identify {

namespace {

using Complex = std::complex<double>;
using Roots = std::vector<Complex>;

struct Group {
  Roots poles;
  Roots zeros;
};

double damping_of(const Roots& poles) {
  const Complex pole = poles.front();
  return pole.imag() == 0.0 ? 1.0 : std::abs(pole.real()) / std::abs(pole);
}

// Conjugate pairs by rising damping, then the real ones two by two from the fastest down.
std::vector<Roots> paired(const Roots& roots) {
  std::vector<Roots> pairs;
  Roots real;
  std::ptrdiff_t balance = 0;
  for (const Complex root : roots) {
    if (root.imag() == 0.0) real.push_back(root);
    if (root.imag() > 0.0) pairs.push_back({root, std::conj(root)});
    balance += root.imag() > 0.0 ? 1 : root.imag() < 0.0 ? -1 : 0;
  }
  if (balance != 0)
    throw std::invalid_argument("sections: a complex root lacks its conjugate; list both");
  std::sort(pairs.begin(), pairs.end(),
            [](const Roots& a, const Roots& b) { return damping_of(a) < damping_of(b); });
  std::sort(real.begin(), real.end(),
            [](Complex a, Complex b) { return std::abs(a) > std::abs(b); });
  for (std::size_t i = 0; i < real.size(); i += 2)
    pairs.push_back(i + 1 < real.size() ? Roots{real[i], real[i + 1]} : Roots{real[i]});
  return pairs;
}

// On a logarithmic scale, so that a zero of the same frequency is near.
double distance(Complex pole, Complex zero) {
  return std::abs(pole - zero) / (std::abs(pole) + std::abs(zero) + 1e-300);
}

void take(Roots& zeros, std::size_t index, Group& group) {
  group.zeros.push_back(zeros[index]);
  zeros.erase(zeros.begin() + static_cast<std::ptrdiff_t>(index));
}

// The nearest zero of the kind asked for, a complex one with its conjugate; false without room.
bool pick_zero(Group& group, Roots& zeros, bool complex) {
  if (group.zeros.size() + (complex ? 2 : 1) > group.poles.size()) return false;
  std::size_t nearest = zeros.size();
  for (std::size_t i = 0; i < zeros.size(); ++i) {
    if ((zeros[i].imag() != 0.0) != complex) continue;
    if (nearest == zeros.size() ||
        distance(group.poles.front(), zeros[i]) < distance(group.poles.front(), zeros[nearest]))
      nearest = i;
  }
  if (nearest == zeros.size()) return false;
  const Complex partner = std::conj(zeros[nearest]);
  take(zeros, nearest, group);
  if (!complex) return true;
  const auto other = std::find(zeros.begin(), zeros.end(), partner);
  if (other == zeros.end())
    throw std::invalid_argument("sections: a complex root lacks its conjugate; list both");
  take(zeros, static_cast<std::size_t>(other - zeros.begin()), group);
  return true;
}

std::array<double, 3> coefficients(const Roots& roots) {
  const std::vector<double> p = polynomial_from_roots(roots);
  std::array<double, 3> padded{};
  std::copy_backward(p.begin(), p.end(), padded.end());
  return padded;
}

double reference_frequency(const Roots& poles) {
  double sum = 0.0;
  int count = 0;
  for (const Complex pole : poles) {
    if (pole == 0.0) continue;
    sum += std::log(std::abs(pole));
    ++count;
  }
  return count == 0 ? 1.0 : std::exp(sum / count);
}

// First the whole gain in one section, then the same magnitude for all at one frequency.
void spread_gain(const ZerosPolesGain& model, std::vector<Section>& sections) {
  const Complex s{0.0, 1.03 * reference_frequency(model.poles)};  // off any root on the axis
  double log_total = std::log(std::abs(model.gain));
  for (const Section& section : sections) log_total += std::log(std::abs(section.at(s)));
  const double share = log_total / static_cast<double>(sections.size());
  for (Section& section : sections) {
    const double factor = std::exp(share) / std::abs(section.at(s));
    for (double& coefficient : section.num) coefficient *= factor;
  }
  if (model.gain < 0.0)
    for (double& coefficient : sections.front().num) coefficient = -coefficient;
}

}  // namespace

Complex Section::at(Complex s) const {
  return ((num[0] * s + num[1]) * s + num[2]) / ((den[0] * s + den[1]) * s + den[2]);
}

std::vector<Section> second_order_sections(const ZerosPolesGain& model) {
  if (model.zeros.size() > model.poles.size())
    throw std::invalid_argument("sections: more zeros than poles; the model must be proper");
  if (model.poles.empty()) return {Section{{0.0, 0.0, model.gain}, {0.0, 0.0, 1.0}}};
  std::vector<Group> groups;
  for (const Roots& pair : paired(model.poles)) groups.push_back({pair, {}});
  paired(model.zeros);
  Roots zeros = model.zeros;
  // Complex pairs first: at most one group has a single pole, so they all find room, and the real
  // ones fill what is left.
  for (Group& group : groups) pick_zero(group, zeros, true);
  for (Group& group : groups)
    while (pick_zero(group, zeros, false)) {
    }
  std::vector<Section> sections;
  for (auto group = groups.rbegin(); group != groups.rend(); ++group)
    sections.push_back({coefficients(group->zeros), coefficients(group->poles)});
  if (model.gain == 0.0) {
    sections.front().num = {};
    return sections;
  }
  spread_gain(model, sections);
  return sections;
}

}  // namespace sinerig::identify
