#include "sweep/plan_refused.h"

#include <cstdio>

namespace sinerig {

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

}  // namespace sinerig
