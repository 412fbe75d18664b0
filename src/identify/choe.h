// Choe's method: the additive uncertainty of models of several sub-bands as the weight of Hassul's
// least squares ("A Simple Method for Frequency Domain Identification", section 3, steps 1 to 3).
#pragma once

#include <complex>
#include <vector>

#include "identify/hassul.h"
#include "identify/response.h"
#include "identify/transfer_function.h"

namespace sinerig::identify {

// Every intermediate of the method; the vectors over frequency are on the grid of the response.
struct ChoeFit {
  std::vector<Response> bands;                // step 1: the sub-bands as used
  std::vector<TransferFunction> band_models;  // step 2: eq. (11) on each
  std::vector<std::complex<double>> nominal;  // G_nom(jω): mean of the models' responses
  std::vector<std::vector<double>> additive;  // eq. (15): |G_k − G_nom|(jω), one row per model
  std::vector<double> weight;                 // |W_a|(jω): their largest, floored
  TransferFunction model;                     // eq. (13) with that weight
};

// Frequencies between `bands` sub-bands of equal logarithmic width, rad/s: one less than bands.
// Throws std::invalid_argument when bands < 1.
std::vector<double> equal_band_edges(const Response& response, int bands);

// edges_rad_s: rising frequencies that part the sub-bands; one that is measured belongs to the
// lower band, as in a sweep by sub-bands. Throws std::invalid_argument when they do not rise.
ChoeFit fit_choe(const Response& response, const HassulOrders& orders,
                 const std::vector<double>& edges_rad_s);

// bands: number of sub-bands of equal logarithmic width asked for; a band with fewer than
// 2(n+m+1) real equations is merged with its upper neighbour (the last with its lower), so fewer
// may come back. Where the models agree to 1e-12 of the largest response the weight is one.
// Throws std::invalid_argument when bands < 1, and as fit_hassul does.
ChoeFit fit_choe(const Response& response, const HassulOrders& orders, int bands = 3);

}  // namespace sinerig::identify
