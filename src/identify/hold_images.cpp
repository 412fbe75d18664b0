#include "identify/hold_images.h"

#include <cmath>

namespace sinerig::identify {

Eigen::ArrayXcd model_on_grid(const FitData& data, const GridRational& rational) {
  Eigen::ArrayXcd model = data.known * rational.N / rational.D;
  if (rational.delay_s != 0.0)
    for (Eigen::Index i = 0; i < model.size(); ++i)
      model[i] *= std::polar(1.0, -data.omega[i] * rational.delay_s);
  return model;
}

std::optional<Eigen::ArrayXcd> hold_images(const FitData& plain, const Freedom& freedom,
                                           const GridRational& rational, const HoldModel& hold) {
  const LocalModel model(plain, freedom, rational);
  const LocalModel::Parameters& at = model.parameters();
  const Eigen::ArrayXcd exact =
      hold.response(model.N_basis(), at.n, model.D_basis(), at.d, at.delay_s, plain);
  const Eigen::ArrayXcd images = exact / model_on_grid(plain, model.on_grid());
  if (!images.allFinite()) return {};
  return images;
}

}  // namespace sinerig::identify
