// Random names that nobody can guess: of a run, and for stopping it.
#pragma once

#include <string>

namespace sinerig::dashboard {

// 128 bits from the kernel, in hexadecimal. Throws std::runtime_error where it gives none.
std::string random_token();

}  // namespace sinerig::dashboard
