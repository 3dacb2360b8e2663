#include <pybind11/numpy.h>

#include <cmath>
#include <map>
#include <optional>

#include "sextant/eval/export/record_columns.h"
#include "sextant/eval/python/bindings.h"
#include "sextant/eval/records/record_stream.h"

namespace py = pybind11;

namespace sextant {
namespace {

/// A column that is being filled; `at` is where its next value goes.
struct Filling {
  py::array values;
  char* at = nullptr;
  std::map<const std::string*, int32_t> places;
  std::vector<Interned> texts;

  template <typename T>
  void put(T value) {
    *reinterpret_cast<T*>(at) = value;
    at += sizeof value;
  }
  int32_t place(Interned text) {
    const auto [it, is_new] = places.emplace(&text.str(), static_cast<int32_t>(texts.size()));
    if (is_new) texts.push_back(text);
    return it->second;
  }
};

py::array empty_column(ColumnKind kind, uint64_t n) {
  const auto rows = static_cast<py::ssize_t>(n);
  if (kind == ColumnKind::text) return py::array_t<int32_t>(rows);
  if (kind == ColumnKind::integer) return py::array_t<int64_t>(rows);
  if (kind == ColumnKind::unsigned_integer) return py::array_t<uint64_t>(rows);
  return py::array_t<double>(rows);
}

void put(Filling& column, ColumnKind kind, const RecordValue& value) {
  if (kind == ColumnKind::text) {
    const auto* text = std::get_if<Interned>(&value);
    column.put(text == nullptr ? int32_t{-1} : column.place(*text));
  } else if (kind == ColumnKind::number) {
    const auto* number = std::get_if<double>(&value);
    column.put(number == nullptr ? NAN : *number);
  } else if (const auto* integer = std::get_if<int64_t>(&value)) {
    column.put(*integer);
  } else {
    column.put(std::get<uint64_t>(value));
  }
}

/// [(name, array, None)], of texts [(name, places, texts)], in order of the columns.
py::list read_records(const std::string& folder) {
  std::vector<Filling> filling;
  std::vector<RecordColumn> columns;
  {
    std::optional<RecordColumns> records;
    {
      const py::gil_scoped_release others_run;
      records.emplace(folder);
    }
    columns = records->columns();
    for (const RecordColumn& column : columns) {
      filling.push_back({empty_column(column.kind, records->n_rows())});
      filling.back().at = static_cast<char*>(filling.back().values.mutable_data());
    }
    const py::gil_scoped_release others_run;
    records->for_each_row([&](std::span<const RecordValue> row) {
      for (size_t i = 0; i < row.size(); ++i) put(filling[i], columns[i].kind, row[i]);
    });
  }
  py::list out;
  for (size_t i = 0; i < columns.size(); ++i) {
    py::object texts = py::none();
    if (columns[i].kind == ColumnKind::text) {
      py::list all;
      for (const Interned& text : filling[i].texts) all.append(text.str());
      texts = all;
    }
    out.append(py::make_tuple(columns[i].name, filling[i].values, texts));
  }
  return out;
}

}  // namespace

void bind_records(py::module_& core) { core.def("read_records", read_records); }

}  // namespace sextant
