// Polynomials with real coefficients in descending powers.
#pragma once

#include <complex>
#include <vector>

#include "identify/transfer_function.h"

namespace sinerig::identify {

// Value at s by Horner's rule; an empty polynomial is zero.
std::complex<double> evaluate_polynomial(const std::vector<double>& coefficients,
                                         std::complex<double> s);

// First coefficient that is not zero. Throws std::invalid_argument when there is none.
double leading_coefficient(const std::vector<double>& coefficients);

// Coefficients of the product of two polynomials.
std::vector<double> multiply_polynomials(const std::vector<double>& a,
                                         const std::vector<double>& b);

// Eigenvalues come in no particular order and with conjugates equal only to rounding: sorts by
// magnitude, makes pairs exact, and makes real what is real to within 1e-14 of its magnitude.
void tidy_conjugate_pairs(std::vector<std::complex<double>>& roots);

}  // namespace sinerig::identify
