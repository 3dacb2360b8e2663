#pragma once

// Relation between the normals of the pixels of one frame and channel: independent, one draw for all pixels,
// or a stationary Gaussian field with a given correlation (problem.h):
//
//   "independent"   "shared_per_frame"   {"model": "spatial", "lengths_px": [5, 40], "shares": [0.4, 0.5]}
//
// A field is the sum of one component per length and of an independent rest. A component of length L is white
// noise on the nodes of a lattice, with one draw per node, smoothed by a Gaussian kernel:
//
//   n(p) = sum_q w(p - q) n_q / sqrt(sum_q w(p - q)^2),   w(d) = exp(-|d|^2 / L^2).
//
// It has exactly unit variance at every pixel and correlation exp(-r^2 / (2 L^2)); with this dense sampling
// (spacing floor(L / 1.5) px, at least 1 px), sum_q w(p - q) w(p' - q) varies with the phase of the lattice
// by less than 1e-4. The kernel is separable and truncated at 2.5 L. A draw therefore remains a pure function
// of (seed, dataset, sequence, frame, channel, pixel), and needs few nodes.

#include "sextant/base/json.h"
#include "sextant/measurement/problem.h"
#include "sextant/noise/draws.h"

namespace sextant {

class NoiseCorrelation {
 public:
  NoiseCorrelation(Correlation of_pixels = Correlation::independent) : of_pixels_(of_pixels) {}
  /// Throws Error unless there are 1 to 100 components, every length is in 1..1000 px, every share is
  /// positive, and the shares add up to at most 1.
  explicit NoiseCorrelation(const SpatialCorrelation& spatial);
  /// Reads a name or an object as above. Throws Error that begins with `where`.
  static NoiseCorrelation read(const Json& json, const std::string& where);

  Json json() const;
  /// Returns a text for records: "" for independent, " (shared per frame)", " (spatial 5, 40 px)".
  std::string name() const;
  bool independent() const { return of_pixels_ == Correlation::independent && fields_.empty(); }
  const SpatialCorrelation& spatial() const { return spatial_; }

  /// Computes two independent standard normals for every pixel; `first` and `second` have the length of
  /// `pixels`.
  void normals(const Draws& draws, NoiseChannel channel, const PixelBatch& pixels, std::span<double> first,
               std::span<double> second) const;

 private:
  /// One component: values of the kernel at the nodes around a pixel, for each position of the pixel between
  /// two nodes.
  struct Field {
    int spacing_px;
    int reach;                    ///< number of nodes on either side of a pixel
    std::vector<double> weights;  ///< 2 reach for each of `spacing_px` positions; their squares add up to 1
    double amplitude;             ///< sqrt(share)
    explicit Field(const SpatialCorrelation::Part& part);
    void add(const Draws& draws, NoiseChannel channel, const PixelBatch& pixels, std::span<double> first,
             std::span<double> second) const;
  };

  Correlation of_pixels_ = Correlation::independent;
  SpatialCorrelation spatial_;
  std::vector<Field> fields_;
};

}  // namespace sextant
