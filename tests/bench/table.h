// A benchmark's table: each figure beside its bound.
#pragma once

#include <cstdio>
#include <string>

namespace sinerig::bench {

class Table {
 public:
  void section(const std::string& title) const { std::printf("\n%s\n", title.c_str()); }

  void at_most(const std::string& name, double value, double bound, const std::string& unit) {
    row(name, value, "<=", bound, unit, value <= bound);
  }
  void at_least(const std::string& name, double value, double bound, const std::string& unit) {
    row(name, value, ">=", bound, unit, value >= bound);
  }
  void within(const std::string& name, double value, double low, double high,
              const std::string& unit) {
    const bool met = value >= low && value <= high;
    std::printf("  %-58s %12.4g  in [%.4g, %.4g] %s  %s\n", name.c_str(), value, low, high,
                unit.c_str(), verdict(met));
  }
  void figure(const std::string& name, double value, const std::string& unit) const {
    std::printf("  %-58s %12.4g  %s\n", name.c_str(), value, unit.c_str());
  }
  void note(const std::string& text) const { std::printf("  %s\n", text.c_str()); }

  // Number of bounds missed; prints the sum.
  int finish() const {
    std::printf("\n%d of %d bounds met\n", rows_ - missed_, rows_);
    return missed_;
  }

 private:
  const char* verdict(bool met) {
    ++rows_;
    missed_ += met ? 0 : 1;
    return met ? "met" : "MISSED";
  }
  void row(const std::string& name, double value, const char* relation, double bound,
           const std::string& unit, bool met) {
    std::printf("  %-58s %12.4g  %s %.4g %s  %s\n", name.c_str(), value, relation, bound,
                unit.c_str(), verdict(met));
  }
  int rows_ = 0;
  int missed_ = 0;
};

}  // namespace sinerig::bench
