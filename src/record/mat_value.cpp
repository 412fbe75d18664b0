#include "record/mat_value.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "record/utf8.h"

namespace sinerig::record {

namespace {

// UTF-16 of UTF-8; what is outside the basic plane or malformed becomes '?'.
std::vector<std::uint16_t> to_utf16(const std::string& text) {
  std::vector<std::uint16_t> units;
  for (std::size_t i = 0; i < text.size();) {
    const auto at = [&](std::size_t k) {
      return k < text.size() ? static_cast<unsigned char>(text[k]) : 0U;
    };
    const unsigned lead = at(i);
    const std::size_t length = lead < 0x80U ? 1 : lead < 0xE0U ? 2 : lead < 0xF0U ? 3 : 4;
    const unsigned unit =
        length == 1   ? lead
        : length == 2 ? (lead & 0x1FU) << 6U | (at(i + 1) & 0x3FU)
        : length == 3 ? (lead & 0x0FU) << 12U | (at(i + 1) & 0x3FU) << 6U | (at(i + 2) & 0x3FU)
                      : '?';
    units.push_back(static_cast<std::uint16_t>(unit));
    i += length;
  }
  return units;
}

void append_utf8(std::string& text, unsigned unit) {
  const auto put = [&](unsigned byte) {
    text += static_cast<char>(byte);
  };
  if (unit < 0x80U) {
    put(unit);
  } else if (unit < 0x800U) {
    put(0xC0U | unit >> 6U);
    put(0x80U | (unit & 0x3FU));
  } else {
    put(0xE0U | unit >> 12U);
    put(0x80U | (unit >> 6U & 0x3FU));
    put(0x80U | (unit & 0x3FU));
  }
}

std::size_t element_count(const matvar_t* value) {
  std::size_t count = 1;
  for (int i = 0; i < value->rank; ++i) count *= value->dims[i];
  return count;
}

template <typename Type>
void widen(const void* data, std::size_t count, std::vector<double>& values) {
  const auto* typed = static_cast<const Type*>(data);
  values.assign(typed, typed + count);
}

std::vector<double> widened(const matvar_t* value, const void* data) {
  const std::size_t count = element_count(value);
  std::vector<double> values;
  switch (value->data_type) {
    case MAT_T_DOUBLE: widen<double>(data, count, values); break;
    case MAT_T_SINGLE: widen<float>(data, count, values); break;
    case MAT_T_INT32: widen<std::int32_t>(data, count, values); break;
    case MAT_T_UINT32: widen<std::uint32_t>(data, count, values); break;
    case MAT_T_INT16: widen<std::int16_t>(data, count, values); break;
    case MAT_T_UINT16: widen<std::uint16_t>(data, count, values); break;
    case MAT_T_INT8: widen<std::int8_t>(data, count, values); break;
    case MAT_T_UINT8: widen<std::uint8_t>(data, count, values); break;
    default: break;
  }
  return values;
}

// matio copies the data, though its signature does not say so.
MatValue made(const std::string& name, matio_classes kind, matio_types type, Dimensions dimensions,
              const void* data, int options) {
  return MatValue{Mat_VarCreate(name.empty() ? nullptr : name.c_str(), kind, type,
                                static_cast<int>(dimensions.size()), dimensions.data(),
                                const_cast<void*>(data), options)};
}

// Unlike ==, takes NaN for NaN.
bool same_bits(const std::vector<std::complex<double>>& a,
               const std::vector<std::complex<double>>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(a.front())) == 0);
}

}  // namespace

MatValue mat_array(const std::string& name, const Dimensions& dimensions,
                   const std::vector<double>& values) {
  return made(name, MAT_C_DOUBLE, MAT_T_DOUBLE, dimensions, values.data(), 0);
}

MatValue mat_array(const std::string& name, const Dimensions& dimensions,
                   const std::vector<std::complex<double>>& values) {
  std::vector<double> re;
  std::vector<double> im;
  for (const std::complex<double>& value : values) {
    re.push_back(value.real());
    im.push_back(value.imag());
  }
  const mat_complex_split_t split{re.data(), im.data()};
  return made(name, MAT_C_DOUBLE, MAT_T_DOUBLE, dimensions, &split, MAT_F_COMPLEX);
}

MatValue mat_text(const std::string& name, const std::string& text) {
  const std::vector<std::uint16_t> units = to_utf16(text);
  return made(name, MAT_C_CHAR, MAT_T_UTF16, {units.empty() ? 0U : 1U, units.size()}, units.data(),
              0);
}

MatValue mat_texts(const std::string& name, const Dimensions& dimensions,
                   const std::vector<std::string>& texts) {
  std::vector<matvar_t*> cells;
  cells.reserve(texts.size());
  for (const std::string& text : texts) cells.push_back(mat_text("", text).release());
  return made(name, MAT_C_CELL, MAT_T_CELL, dimensions, cells.data(), 0);
}

std::vector<double> real_values(const matvar_t* value) {
  const bool numeric = value != nullptr && value->data != nullptr && value->isComplex == 0 &&
                       value->class_type >= MAT_C_DOUBLE && value->class_type <= MAT_C_UINT64;
  return numeric ? widened(value, value->data) : std::vector<double>{};
}

std::vector<std::complex<double>> complex_values(const matvar_t* value) {
  std::vector<std::complex<double>> values;
  if (value == nullptr || value->data == nullptr) return values;
  if (value->isComplex == 0) {
    const std::vector<double> real = real_values(value);
    return {real.begin(), real.end()};
  }
  const auto* split = static_cast<const mat_complex_split_t*>(value->data);
  const std::vector<double> re = widened(value, split->Re);
  const std::vector<double> im = widened(value, split->Im);
  for (std::size_t i = 0; i < re.size(); ++i) values.emplace_back(re[i], im[i]);
  return values;
}

std::string text_value(const matvar_t* value) {
  std::string text;
  if (value == nullptr || value->class_type != MAT_C_CHAR || value->data == nullptr) return text;
  const std::size_t count = element_count(value);
  if (value->data_type == MAT_T_UTF16 || value->data_type == MAT_T_UINT16) {
    const auto* units = static_cast<const std::uint16_t*>(value->data);
    for (std::size_t i = 0; i < count; ++i) append_utf8(text, units[i]);
    return text;
  }
  const auto* bytes = static_cast<const char*>(value->data);
  text.assign(bytes, bytes + std::min(count, value->nbytes));
  return as_utf8(text);
}

std::vector<std::string> text_values(const matvar_t* value) {
  if (value == nullptr) return {};
  if (value->class_type == MAT_C_CHAR) return {text_value(value)};
  std::vector<std::string> texts;
  if (value->class_type != MAT_C_CELL || value->data == nullptr) return texts;
  auto* const* cells = static_cast<matvar_t* const*>(value->data);
  for (std::size_t i = 0; i < element_count(value); ++i) texts.push_back(text_value(cells[i]));
  return texts;
}

bool same_value(const matvar_t& a, const matvar_t& b) {
  return a.name != nullptr && b.name != nullptr && std::strcmp(a.name, b.name) == 0 &&
         a.class_type == b.class_type && same_bits(complex_values(&a), complex_values(&b)) &&
         text_values(&a) == text_values(&b);
}

}  // namespace sinerig::record
