#pragma once

// Instance masks of MOTS (Voigtlaender et al., CVPR 2019; www.vision.rwth-aachen.de/page/mots): text and PNG.
//
//   text  one line per object and frame: "frame id class_id height width rle"
//   PNG   16-bit gray: the same ids, 0 = background
//   id    class_id * 1000 + track id; class 1 car, 2 pedestrian, 10 ignore (an unlabelled region)
//   rle   COCO's compressed run lengths: the image column by column, runs of 0 and 1 in turn, the first of 0.
//         From the fourth run on, the number two places before is subtracted. Each number is cut into groups
//         of 5 bits, lowest first, as two's complement: bit 4 of the last group is the sign. Each group is
//         one character, whose code is 48 + group, + 32 if another group follows.
//
// In decoded masks, an object's id is its track id + 1 (as in all masks of KITTI in this project); ignored
// regions are background. Detections in the same text format (TrackR-CNN) have arbitrary ids and may overlap.

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/measurement/image.h"

namespace sextant {

/// Returns the lengths of the runs, px. `where` ("FILE:LINE") is the prefix of messages. Throws Error on a
/// character outside the alphabet, a truncated number, a negative run, or runs that do not add up to `width`
/// * `height`.
std::vector<uint32_t> decode_rle(std::string_view rle, int width, int height, const std::string& where);
std::string encode_rle(std::span<const uint32_t> runs);

/// Encodes the pixels of `mask` that equal `id` as run lengths.
std::string encode_rle(const Image<uint16_t>& mask, uint16_t id);

enum class MotsIds {
  tracks,     ///< id = class * 1000 + track; objects must not overlap
  detections  ///< any id 1..65535; of overlapping objects the earlier line is in front
};

/// A text file, whose run lengths are decoded per requested frame.
class MotsText {
 public:
  struct Row {
    int64_t line = 0;
    int id = 0;  ///< id in the file
    int class_id = 0;
    int height = 0;  ///< px
    int width = 0;   ///< px
    std::string rle;
  };

  /// Parses the file. Throws Error "NAME:LINE: ..." on a malformed row, a class or id outside the range of
  /// `ids`, or an id or track that is repeated in a frame.
  MotsText(std::string_view text, std::string name, MotsIds ids = MotsIds::tracks);

  std::set<int> frames() const;                ///< frames with at least one object
  std::span<const Row> rows(int frame) const;  ///< in the order of the file; may be empty

  /// Returns the mask of a frame, all background without rows. Throws Error "NAME:LINE: ..." if a row has
  /// another size, its run lengths are invalid, or two objects overlap (MotsIds::tracks). Safe to call from
  /// several threads.
  Image<uint16_t> mask(int frame, int width, int height) const;

 private:
  void add(int frame, Row row);

  std::string name_;
  MotsIds ids_;
  std::map<int, std::vector<Row>> rows_;
};

/// Encodes masks by frame. `class_of` contains the class of each id, 1 if absent. Throws Error if an id
/// (track id + 1) is above 1000 or a class is not 1 or 2.
std::string encode_mots_text(const std::map<int, Image<uint16_t>>& masks, const std::map<int, int>& class_of);

/// Convert between the numbers of a MOTS PNG and object ids (track id + 1). Decoding throws Error that names
/// the pixel if a number is not a MOTS id or a track has two classes; encoding throws Error like
/// encode_mots_text().
Image<uint16_t> mask_from_mots(const Image<uint16_t>& image, const std::string& name);
Image<uint16_t> mots_from_mask(const Image<uint16_t>& mask, const std::map<int, int>& class_of);

}  // namespace sextant
