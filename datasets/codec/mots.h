#pragma once

// Instance masks of MOTS (Voigtlaender et al., CVPR 2019; www.vision.rwth-aachen.de/page/mots): text and PNG.
//
//   text  one line per object and frame: "frame id class_id height width rle"
//   PNG   16-bit gray: the same ids, 0 = background
//   id    class_id * 1000 + track id; class 1 car, 2 pedestrian, 10 ignore (a region nobody labelled)
//   rle   COCO's compressed run lengths: the image column by column, runs of 0 and 1 in turn, the first of 0.
//         Each number, from the fourth on less the number two before it, is cut into groups of 5 bits, lowest
//         first, as two's complement: bit 4 of the last group is the sign. Each group is one character, whose
//         code is 48 + group, + 32 if another group follows.
//
// In the masks here, an object's id is its track id + 1 (as in all of our masks of KITTI); ignored regions
// are background. Detections in the same text form (TrackR-CNN) have ids of their own and may overlap.

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sextant/measurement/image.h"

namespace sextant {

/// The runs, in pixels. `where` ("FILE:LINE") stands before messages. Throws Error on a character outside of
/// the alphabet, a number cut off, a negative run, or runs that do not add up to `width` * `height`.
std::vector<uint32_t> decode_rle(std::string_view rle, int width, int height, const std::string& where);
std::string encode_rle(std::span<const uint32_t> runs);

/// The pixels of `mask` that equal `id`, as run lengths.
std::string encode_rle(const Image<uint16_t>& mask, uint16_t id);

enum class MotsIds {
  tracks,     ///< id = class * 1000 + track; objects must not overlap
  detections  ///< any id 1..65535; of overlapping objects the earlier line is in front
};

/// A text file. Its run lengths are decoded when a frame is asked for.
class MotsText {
 public:
  struct Row {
    int64_t line = 0;
    int id = 0;  ///< as in the file
    int class_id = 0;
    int height = 0;  ///< px
    int width = 0;   ///< px
    std::string rle;
  };

  /// Throws Error "NAME:LINE: ..." on a row of another form, a class or id that MOTS does not have, or an id
  /// that a frame has twice.
  MotsText(std::string_view text, std::string name, MotsIds ids = MotsIds::tracks);

  std::set<int> frames() const;                ///< those with an object
  std::span<const Row> rows(int frame) const;  ///< in order of the file; may be empty

  /// All background for a frame without rows. Throws Error "NAME:LINE: ..." when a row is of another size,
  /// its run lengths are bad, or two objects overlap. Safe to call from several threads.
  Image<uint16_t> mask(int frame, int width, int height) const;

 private:
  void add(int frame, Row row);

  std::string name_;
  MotsIds ids_;
  std::map<int, std::vector<Row>> rows_;
};

/// Masks by frame, with our ids (track id + 1; at most 1000); `class_of` gives the class of each id, 1 when
/// it is absent.
std::string encode_mots_text(const std::map<int, Image<uint16_t>>& masks, const std::map<int, int>& class_of);

/// Between the numbers of a MOTS PNG and our ids. Decoding throws Error, which names the pixel, on a number
/// that is no MOTS id, and on a track id of two classes.
Image<uint16_t> mask_from_mots(const Image<uint16_t>& image, const std::string& name);
Image<uint16_t> mots_from_mask(const Image<uint16_t>& mask, const std::map<int, int>& class_of);

}  // namespace sextant
