#include "sextant/datasets/codec/png_filter.h"

#include <cstdlib>
#include <cstring>

#include "sextant/base/error.h"
#include "sextant/base/simd.h"

#if SEXTANT_X86
#include <emmintrin.h>
#endif

namespace sextant::internal {
namespace {

uint8_t paeth(int a, int b, int c) {
  const int pa = std::abs(b - c);
  const int pb = std::abs(a - c);
  const int pc = std::abs(a + b - 2 * c);
  if (pa <= pb && pa <= pc) return static_cast<uint8_t>(a);
  return static_cast<uint8_t>(pb <= pc ? b : c);
}

void add_row(uint8_t* row, const uint8_t* prior, size_t n) {
  for (size_t i = 0; i < n; ++i) row[i] = static_cast<uint8_t>(row[i] + prior[i]);
}

#if SEXTANT_X86
// Processes one pixel per step, with its bytes in the lanes of a register: there are no branches, which would
// be mispredicted on images, and the left pixel stays in the register. Loads read 8 bytes, of which BPP are
// used: narrower loads are assembled in memory and stall.
__m128i load_pixel(const uint8_t* p) { return _mm_loadl_epi64(reinterpret_cast<const __m128i*>(p)); }

template <int BPP>
void store_pixel(uint8_t* p, __m128i pixel) {
  const uint64_t bits = static_cast<uint64_t>(_mm_cvtsi128_si64(pixel));
  const auto store = [p](auto part, size_t at) { std::memcpy(p + at, &part, sizeof part); };
  if constexpr (BPP == 8) store(bits, 0);
  if constexpr (BPP == 4 || BPP == 6) store(static_cast<uint32_t>(bits), 0);
  if constexpr (BPP == 6) store(static_cast<uint16_t>(bits >> 32), 4);
  if constexpr (BPP == 2 || BPP == 3) store(static_cast<uint16_t>(bits), 0);
  if constexpr (BPP == 3) store(static_cast<uint8_t>(bits >> 16), 2);
  if constexpr (BPP == 1) store(static_cast<uint8_t>(bits), 0);
}

__m128i abs16(__m128i x) { return _mm_max_epi16(x, _mm_sub_epi16(_mm_setzero_si128(), x)); }

__m128i select(__m128i mask, __m128i yes, __m128i no) {
  return _mm_or_si128(_mm_and_si128(mask, yes), _mm_andnot_si128(mask, no));
}

template <int BPP>
void undo_sub(uint8_t* row, size_t n) {
  __m128i a = _mm_setzero_si128();
  for (size_t i = 0; i + BPP <= n; i += BPP) {
    a = _mm_add_epi8(a, load_pixel(row + i));
    store_pixel<BPP>(row + i, a);
  }
}

template <int BPP>
void undo_average(uint8_t* row, const uint8_t* prior, size_t n) {
  __m128i a = _mm_setzero_si128();
  const __m128i one = _mm_set1_epi8(1);
  for (size_t i = 0; i + BPP <= n; i += BPP) {
    const __m128i b = prior == nullptr ? _mm_setzero_si128() : load_pixel(prior + i);
    const __m128i rounded_up = _mm_and_si128(_mm_xor_si128(a, b), one);
    const __m128i average = _mm_sub_epi8(_mm_avg_epu8(a, b), rounded_up);
    a = _mm_add_epi8(load_pixel(row + i), average);
    store_pixel<BPP>(row + i, a);
  }
}

template <int BPP>
void undo_paeth(uint8_t* row, const uint8_t* prior, size_t n) {
  const __m128i zero = _mm_setzero_si128();
  __m128i a = zero;  // 16-bit lanes, for the differences
  __m128i c = zero;
  const __m128i low_byte = _mm_set1_epi16(0xff);
  for (size_t i = 0; i + BPP <= n; i += BPP) {
    const __m128i b = _mm_unpacklo_epi8(load_pixel(prior + i), zero);
    const __m128i x = _mm_unpacklo_epi8(load_pixel(row + i), zero);
    const __m128i from_a = _mm_sub_epi16(b, c);
    const __m128i from_b = _mm_sub_epi16(a, c);
    const __m128i pa = abs16(from_a);
    const __m128i pb = abs16(from_b);
    const __m128i pc = abs16(_mm_add_epi16(from_a, from_b));
    const __m128i smallest = _mm_min_epi16(pc, _mm_min_epi16(pa, pb));
    const __m128i nearest =
        select(_mm_cmpeq_epi16(smallest, pa), a, select(_mm_cmpeq_epi16(smallest, pb), b, c));
    a = _mm_and_si128(_mm_add_epi16(x, nearest), low_byte);
    c = b;
    store_pixel<BPP>(row + i, _mm_packus_epi16(a, a));
  }
}
#else
template <int BPP>
void undo_sub(uint8_t* row, size_t n) {
  for (size_t i = BPP; i < n; ++i) row[i] = static_cast<uint8_t>(row[i] + row[i - BPP]);
}

template <int BPP>
void undo_average(uint8_t* row, const uint8_t* prior, size_t n) {
  for (size_t i = 0; i < n; ++i) {
    const int left = i < BPP ? 0 : row[i - BPP];
    const int up = prior == nullptr ? 0 : prior[i];
    row[i] = static_cast<uint8_t>(row[i] + (left + up) / 2);
  }
}

template <int BPP>
void undo_paeth(uint8_t* row, const uint8_t* prior, size_t n) {
  for (size_t i = 0; i < n; ++i) {
    const bool first = i < BPP;
    const uint8_t nearest = paeth(first ? 0 : row[i - BPP], prior[i], first ? 0 : prior[i - BPP]);
    row[i] = static_cast<uint8_t>(row[i] + nearest);
  }
}
#endif

template <int BPP>
bool unfilter(int filter, uint8_t* row, const uint8_t* prior, size_t n) {
  const bool as_sub =
      filter == 1 || (filter == 4 && prior == nullptr);  // without a row above, Paeth always selects a
  if (as_sub) undo_sub<BPP>(row, n);
  if (filter == 2 && prior != nullptr) add_row(row, prior, n);
  if (filter == 3) undo_average<BPP>(row, prior, n);
  if (filter == 4 && !as_sub) undo_paeth<BPP>(row, prior, n);
  return filter >= 0 && filter <= 4;
}

}  // namespace

bool png_unfilter(int filter, uint8_t* row, const uint8_t* prior, size_t n, int bytes_per_pixel) {
  constexpr decltype(&unfilter<1>) of_size[] = {nullptr, unfilter<1>, unfilter<2>, unfilter<3>, unfilter<4>,
                                                nullptr, unfilter<6>, nullptr,     unfilter<8>};
  SEXTANT_CHECK(bytes_per_pixel > 0 && bytes_per_pixel <= 8 && of_size[bytes_per_pixel] != nullptr);
  return of_size[bytes_per_pixel](filter, row, prior, n);
}

void png_filter(int filter, const uint8_t* row, const uint8_t* prior, size_t n, int bytes_per_pixel,
                uint8_t* filtered) {
  const size_t bpp = static_cast<size_t>(bytes_per_pixel);
  for (size_t i = 0; i < n; ++i) {
    const int a = i < bpp ? 0 : row[i - bpp];
    const int b = prior == nullptr ? 0 : prior[i];
    const int c = i < bpp || prior == nullptr ? 0 : prior[i - bpp];
    int prediction = 0;
    if (filter == 1) prediction = a;
    if (filter == 2) prediction = b;
    if (filter == 3) prediction = (a + b) / 2;
    if (filter == 4) prediction = paeth(a, b, c);
    filtered[i] = static_cast<uint8_t>(row[i] - prediction);
  }
}

}  // namespace sextant::internal
