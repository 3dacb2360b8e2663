#include "sextant/datasets/codec/mots.h"

#include <algorithm>

#include "sextant/datasets/codec/text_rows.h"

namespace sextant {
namespace {

constexpr int ignored_class = 10;
constexpr int64_t max_mask_pixels = int64_t{1} << 25;  // a short run length can declare any number of pixels
constexpr uint16_t ignored_pixel = 65535;              // during drawing only; larger than any track id + 1

bool is_class(int class_id) { return class_id == 1 || class_id == 2 || class_id == ignored_class; }

// Reads the numbers of a run length string.
class RleReader {
 public:
  RleReader(std::string_view text, const std::string& where) : text_(text), where_(where) {}

  bool done() const { return at_ == text_.size(); }

  int64_t number() {
    int64_t value = 0;
    for (int shift = 0;; shift += 5) {
      if (done()) fail("{}: the run lengths end within a number, at character {}", where_, at_);
      const int group = text_[at_] - 48;
      if (group < 0 || group > 63) {
        fail("{}: run lengths: character {} is '{}' (code {}), expected one of '0' to 'o'", where_, at_ + 1,
             text_[at_], static_cast<unsigned char>(text_[at_]));
      }
      if (shift > 35) fail("{}: run lengths: the number at character {} is too large", where_, at_ + 1);
      ++at_;
      value |= static_cast<int64_t>(group & 31) << shift;
      if (group & 32) continue;
      return group & 16 ? value - (int64_t{1} << (shift + 5)) : value;
    }
  }

 private:
  std::string_view text_;
  const std::string& where_;
  size_t at_ = 0;
};

// The id to paint, and the pixels that already belong to other objects: their number, and the first of them.
struct Brush {
  uint16_t id = 0;
  int64_t n_overlap = 0;
  int overlap_x = 0, overlap_y = 0;
};

void paint(std::span<const uint32_t> runs, Image<uint16_t>& mask, Brush& brush) {
  const int height = mask.height();
  int x = 0, y = 0;
  for (size_t i = 0; i < runs.size(); ++i) {
    if (i % 2 == 0) {
      const int64_t next = y + int64_t{runs[i]};
      x += static_cast<int>(next / height);
      y = static_cast<int>(next % height);
      continue;
    }
    for (uint32_t left = runs[i]; left > 0; --left) {
      uint16_t& pixel = mask(x, y);
      if (pixel == 0) {
        pixel = brush.id;
      } else if (brush.n_overlap++ == 0) {
        brush.overlap_x = x;
        brush.overlap_y = y;
      }
      if (++y == height) {
        y = 0;
        ++x;
      }
    }
  }
}

int class_of_id(const std::map<int, int>& class_of, int id) {
  const auto it = class_of.find(id);
  const int class_id = it == class_of.end() ? 1 : it->second;
  if (class_id != 1 && class_id != 2) fail("MOTS: object {} has class {}, expected 1 or 2", id, class_id);
  if (id > 1000)
    fail("MOTS: object {}: the format has track ids 0 to 999, which are object ids minus one", id);
  return class_id;
}

}  // namespace

std::vector<uint32_t> decode_rle(std::string_view rle, int width, int height, const std::string& where) {
  const int64_t n_pixels = int64_t{width} * height;
  RleReader reader(rle, where);
  std::vector<uint32_t> runs;
  runs.reserve(rle.size());
  int64_t sum = 0;
  while (!reader.done()) {
    const int64_t number = reader.number();
    const int64_t run = runs.size() > 2 ? number + runs[runs.size() - 2] : number;
    if (run < 0) fail("{}: run {} has a negative length, {}", where, runs.size() + 1, run);
    sum += run;
    if (sum > n_pixels) {
      fail("{}: the run lengths add up to {} pixels or more, but width x height = {} x {} = {}", where, sum,
           width, height, n_pixels);
    }
    runs.push_back(static_cast<uint32_t>(run));
  }
  if (sum < n_pixels) {
    fail("{}: the run lengths add up to {} pixels, but width x height = {} x {} = {}", where, sum, width,
         height, n_pixels);
  }
  return runs;
}

std::string encode_rle(std::span<const uint32_t> runs) {
  std::string text;
  for (size_t i = 0; i < runs.size(); ++i) {
    int64_t rest = runs[i];
    if (i > 2) rest -= runs[i - 2];
    for (bool more = true; more;) {
      const int group = static_cast<int>(rest & 31);
      rest >>= 5;
      more = rest != (group & 16 ? -1 : 0);
      text += static_cast<char>(48 + group + (more ? 32 : 0));
    }
  }
  return text;
}

std::string encode_rle(const Image<uint16_t>& mask, uint16_t id) {
  std::vector<uint32_t> runs{0};
  bool inside = false;
  for (int x = 0; x < mask.width(); ++x) {
    for (int y = 0; y < mask.height(); ++y) {
      if ((mask(x, y) == id) != inside) {
        inside = !inside;
        runs.push_back(0);
      }
      ++runs.back();
    }
  }
  return encode_rle(runs);
}

MotsText::MotsText(std::string_view text, std::string name, MotsIds ids) : name_(std::move(name)), ids_(ids) {
  for (TextRows rows(text, name_); rows.next();) {
    rows.expect(6, "frame, id, class_id, height, width and run lengths (6 values)");
    const int frame = rows.integer(0, "the frame");
    Row row{rows.line(),
            rows.integer(1, "the id"),
            rows.integer(2, "class_id"),
            rows.integer(3, "the height"),
            rows.integer(4, "the width"),
            std::string(rows.field(5))};
    if (frame < 0) rows.fail_here("frame {}: expected 0 or larger", frame);
    if (row.height <= 0 || row.width <= 0) {
      rows.fail_here("height {} and width {}: expected positive numbers", row.height, row.width);
    }
    if (int64_t{row.height} * row.width > max_mask_pixels) {
      rows.fail_here("height {} and width {}: expected at most {} pixels", row.height, row.width,
                     max_mask_pixels);
    }
    add(frame, std::move(row));
  }
}

void MotsText::add(int frame, Row row) {
  if (ids_ == MotsIds::tracks) {
    if (!is_class(row.class_id)) {
      fail("{}:{}: class_id {}: expected 1 (car), 2 (pedestrian) or 10 (ignore)", name_, row.line,
           row.class_id);
    }
    if (row.id < 0 || row.id / 1000 != row.class_id) {
      fail(
          "{}:{}: id {} of class {}: expected {} to {}, class_id * 1000 "
          "+ track id; ids of another kind are read with detections_txt",
          name_, row.line, row.id, row.class_id, row.class_id * 1000, row.class_id * 1000 + 999);
    }
  } else if (row.id < 1 || row.id > 65535) {
    fail("{}:{}: id {}: expected 1 to 65535", name_, row.line, row.id);
  }
  std::vector<Row>& others = rows_[frame];
  const auto same = [&](const Row& other) {
    const bool both_objects = row.class_id != ignored_class && other.class_id != ignored_class;
    return row.id == other.id ||
           (ids_ == MotsIds::tracks && both_objects && row.id % 1000 == other.id % 1000);
  };
  const auto twin = std::ranges::find_if(others, same);
  if (twin != others.end()) {
    fail("{}:{}: frame {} has track {} twice: id {} here and id {} in line {}", name_, row.line, frame,
         ids_ == MotsIds::tracks ? row.id % 1000 : row.id, row.id, twin->id, twin->line);
  }
  others.push_back(std::move(row));
}

std::set<int> MotsText::frames() const {
  std::set<int> frames;
  for (const auto& [frame, rows] : rows_) frames.insert(frames.end(), frame);
  return frames;
}

std::span<const MotsText::Row> MotsText::rows(int frame) const {
  const auto it = rows_.find(frame);
  if (it == rows_.end()) return {};
  return it->second;
}

Image<uint16_t> MotsText::mask(int frame, int width, int height) const {
  Image<uint16_t> mask(width, height);
  bool any_ignored = false;
  for (const Row& row : rows(frame)) {
    const std::string where = fmt::format("{}:{}", name_, row.line);
    if (row.width != width || row.height != height) {
      fail("{}: the mask of id {} has {}x{} pixels, but the images have {}x{}", where, row.id, row.width,
           row.height, width, height);
    }
    const bool ignored = ids_ == MotsIds::tracks && row.class_id == ignored_class;
    any_ignored |= ignored;
    Brush brush{static_cast<uint16_t>(ids_ == MotsIds::detections ? row.id
                                      : ignored                   ? ignored_pixel
                                                                  : row.id % 1000 + 1)};
    paint(decode_rle(row.rle, width, height, where), mask, brush);
    if (brush.n_overlap > 0 && ids_ == MotsIds::tracks) {
      const uint16_t other = mask(brush.overlap_x, brush.overlap_y);
      fail(
          "{}: the mask of id {} overlaps an earlier one of frame "
          "{} ({}) in {} pixels, the first at column {}, row {}",
          where, row.id, frame, other == ignored_pixel ? "ignore" : fmt::format("track {}", other - 1),
          brush.n_overlap, brush.overlap_x, brush.overlap_y);
    }
  }
  if (any_ignored) std::replace(mask.data(), mask.data() + mask.size(), ignored_pixel, uint16_t{0});
  return mask;
}

std::string encode_mots_text(const std::map<int, Image<uint16_t>>& masks,
                             const std::map<int, int>& class_of) {
  std::string text;
  for (const auto& [frame, mask] : masks) {
    std::set<uint16_t> ids(mask.data(), mask.data() + mask.size());
    ids.erase(0);
    for (const uint16_t id : ids) {
      const int class_id = class_of_id(class_of, id);
      text += fmt::format("{} {} {} {} {} {}\n", frame, class_id * 1000 + id - 1, class_id, mask.height(),
                          mask.width(), encode_rle(mask, id));
    }
  }
  return text;
}

Image<uint16_t> mask_from_mots(const Image<uint16_t>& image, const std::string& name) {
  Image<uint16_t> mask(image.width(), image.height());
  std::map<uint16_t, uint16_t> number_of;  // by object id
  uint16_t last_number = 0, last_id = 0;
  for (size_t i = 0; i < image.size(); ++i) {
    const uint16_t number = image.data()[i];
    if (number != last_number) {
      const int class_id = number / 1000;
      const auto where = [&] {
        const size_t w = static_cast<size_t>(image.width());
        return fmt::format("{}: column {}, row {}", name, i % w, i / w);
      };
      if (number != 0 && !is_class(class_id)) {
        fail("{}: {} is not a MOTS id: expected class * 1000 + track id, class 1, 2 or 10", where(), number);
      }
      const bool object = number != 0 && class_id != ignored_class;
      last_number = number;
      last_id = object ? static_cast<uint16_t>(number % 1000 + 1) : uint16_t{0};
      if (object) {
        const uint16_t first = number_of.emplace(last_id, number).first->second;
        if (first != number) {
          fail("{}: track {} has two classes: it appears as {} and as {}", where(), last_id - 1, first,
               number);
        }
      }
    }
    mask.data()[i] = last_id;
  }
  return mask;
}

Image<uint16_t> mots_from_mask(const Image<uint16_t>& mask, const std::map<int, int>& class_of) {
  Image<uint16_t> image(mask.width(), mask.height());
  uint16_t last_id = 0, last_number = 0;
  for (size_t i = 0; i < mask.size(); ++i) {
    const uint16_t id = mask.data()[i];
    if (id != last_id) {
      last_id = id;
      last_number = id == 0 ? uint16_t{0} : static_cast<uint16_t>(class_of_id(class_of, id) * 1000 + id - 1);
    }
    image.data()[i] = last_number;
  }
  return image;
}

}  // namespace sextant
