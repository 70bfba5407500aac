// A large array on huge pages, where the system has them: dense kernels walk along rows of matrices of many pages.
#pragma once

#if defined(__linux__)
#include <sys/mman.h>
#endif

#include <cstdint>
#include <cstring>
#include <memory>
#include <new>

namespace qlb {

template <class T>
class HugeBuffer {
 public:
  HugeBuffer() = default;
  // Zeros.
  explicit HugeBuffer(std::int64_t size) : size_(size) {
    if (size == 0) return;
    const std::align_val_t alignment{bytes() < 2 * kHugePage ? kCacheLine : kHugePage};
    data_ = {static_cast<T*>(::operator new(bytes(), alignment)), Free{alignment}};
#if defined(__linux__)
    if (bytes() >= 2 * kHugePage) madvise(data_.get(), bytes(), MADV_HUGEPAGE);
#endif
    std::memset(data_.get(), 0, bytes());
  }
  T* data() { return data_.get(); }
  const T* data() const { return data_.get(); }
  std::int64_t size() const { return size_; }
  std::size_t bytes() const { return size_ * sizeof(T); }

 private:
  static constexpr std::size_t kCacheLine = 64, kHugePage = std::size_t{1} << 21;
  struct Free {
    std::align_val_t alignment{kCacheLine};
    void operator()(T* p) const { ::operator delete(p, alignment); }
  };
  std::unique_ptr<T[], Free> data_;
  std::int64_t size_ = 0;
};

}  // namespace qlb
