// A few lines of matio: values that close themselves, arrays and texts in and out.
#pragma once

#include <complex>
#include <matio.h>
#include <memory>
#include <string>
#include <vector>

namespace sinerig::record {

struct MatCloser {
  void operator()(mat_t* file) const { Mat_Close(file); }
  void operator()(matvar_t* value) const { Mat_VarFree(value); }
};
using MatFile = std::unique_ptr<mat_t, MatCloser>;
using MatValue = std::unique_ptr<matvar_t, MatCloser>;
using Dimensions = std::vector<std::size_t>;

// Column-major, as MATLAB stores it.
MatValue mat_array(const std::string& name, const Dimensions& dimensions,
                   const std::vector<double>& values);
MatValue mat_array(const std::string& name, const Dimensions& dimensions,
                   const std::vector<std::complex<double>>& values);
MatValue mat_text(const std::string& name, const std::string& text);
MatValue mat_texts(const std::string& name, const Dimensions& dimensions,
                   const std::vector<std::string>& texts);

// Nothing where the value is not of the kind.
std::vector<std::complex<double>> complex_values(const matvar_t* value);
std::vector<double> real_values(const matvar_t* value);
std::string text_value(const matvar_t* value);
std::vector<std::string> text_values(const matvar_t* value);  // a cell, or one text

// The same name, and to the last bit the same numbers or texts.
bool same_value(const matvar_t& a, const matvar_t& b);

}  // namespace sinerig::record
