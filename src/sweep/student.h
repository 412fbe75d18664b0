// Quantiles of Student's t, for intervals from few degrees of freedom.
#pragma once

namespace sinerig {

// The 97.5 % quantile: half the width of a 95 % interval in standard errors. dof >= 1; infinity
// gives 1.95996. Within 1e-3 relative of the exact value.
double student_t_975(double dof) noexcept;

}  // namespace sinerig
