// The f64 reference: every method written plainly over the window of a pixel, without integral images.

#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Dense>

namespace reference
{
  enum Method { COVARIANCE_MATRIX, AVERAGE_3D_GRADIENT, AVERAGE_DEPTH_CHANGE, SIMPLE_3D_GRADIENT };

  /** \brief What the reference finds for a pixel. */
  struct Result
  {
    Eigen::Vector3d normal = Eigen::Vector3d::Constant (std::numeric_limits<double>::quiet_NaN ());
    double curvature = std::numeric_limits<double>::quiet_NaN ();
    /** \brief The window's points lie on a line or in one place, to f64's rounding: they span no plane. */
    bool is_line = false;
    /** \brief The middle eigenvalue is below the rounding of the f32 sums of squares that PCL forms its matrix
      * from (far from the origin): whether PCL's matrix spans a plane is chance. */
    bool is_below_f32 = false;
    /** \brief The middle eigenvalue is at least 1.01 times the smallest. */
    bool is_plane_defined = false;
  };

  /** \brief One column or row that a window takes, and how often. */
  struct Tap
  {
    int at;
    int weight;
  };

  /** \brief The columns or rows of a window that may cross the border of the image.
    *
    * Mirrored as PCL does it: about the first one at the near border, and without the last one at the far border;
    * an interval whose ends are in reverse order counts negatively, as it does in integral images.
    */
  inline std::vector<Tap>
  taps (int start, int size, int limit, bool mirror)
  {
    std::vector<Tap> result;
    const auto add = [&] (int begin, int end)
    {
      for (int at = begin; at < end; ++at)
        result.push_back ({at, 1});
      for (int at = end; at < begin; ++at)
        result.push_back ({at, -1});
    };
    const int end = start + size;
    if (mirror && start < 0)
    {
      add (0, end);
      add (0, -start);
    }
    else if (mirror && end >= limit)
    {
      add (start, limit - 1);
      add (2 * limit - 1 - end, limit - 1);
    }
    else
      add (start, end);
    return result;
  }

  /** \brief One coordinate of a single pixel that may lie outside the image. */
  inline int
  fold (int at, int limit, bool mirror)
  {
    if (mirror && at < 0)
      return -at;
    return mirror && at >= limit ? 2 * limit - 1 - at : at;
  }

  /** \brief The estimate of pixel (x, y) of an organized cloud from its window, not yet turned to a viewpoint. */
  template <typename Cloud>
  class Pixel
  {
    public:
      Pixel (const Cloud &cloud, bool mirror, int x, int y, int side)
        : cloud_ (cloud), mirror_ (mirror), x_ (x), y_ (y), side_ (side)
      {}

      Result
      estimate (Method method) const
      {
        switch (method)
        {
          case COVARIANCE_MATRIX:    return covarianceMatrix ();
          case AVERAGE_3D_GRADIENT:  return average3DGradient ();
          case AVERAGE_DEPTH_CHANGE: return averageDepthChange ();
          default:                   return simple3DGradient ();
        }
      }

    private:
      Eigen::Vector3d
      at (int x, int y) const
      {
        const auto &point = cloud_[static_cast<std::size_t> (y) * cloud_.width + x];
        return Eigen::Vector3d (point.x, point.y, point.z);
      }

      /** \brief Calls f (x, y, weight) for every pixel of a window. */
      template <typename F> void
      walk (int start_x, int start_y, int width, int height, F f) const
      {
        const auto columns = taps (start_x, width, cloud_.width, mirror_);
        for (const Tap &row : taps (start_y, height, cloud_.height, mirror_))
          for (const Tap &column : columns)
            f (column.at, row.at, column.weight * row.weight);
      }

      static Result
      fromTangents (const Eigen::Vector3d &first, const Eigen::Vector3d &second)
      {
        Result result;
        const Eigen::Vector3d cross = first.cross (second);
        if (cross.squaredNorm () != 0.0)
          result.normal = cross.normalized ();
        result.is_plane_defined = true;
        return result;
      }

      Result
      covarianceMatrix () const
      {
        Result result;
        Eigen::Vector3d mean = Eigen::Vector3d::Zero ();
        double count = 0.0, squares = 0.0;
        const int start_x = x_ - side_ / 2, start_y = y_ - side_ / 2;
        walk (start_x, start_y, side_, side_, [&] (int x, int y, int weight)
        {
          const Eigen::Vector3d point = at (x, y);
          if (!point.allFinite ())
            return;
          mean += weight * point;
          squares += weight * point.cwiseAbs2 ().maxCoeff ();
          count += weight;
        });
        if (count == 0.0)
          return result;
        mean /= count;
        Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero ();
        walk (start_x, start_y, side_, side_, [&] (int x, int y, int weight)
        {
          const Eigen::Vector3d point = at (x, y);
          if (point.allFinite ())
            covariance += weight * (point - mean) * (point - mean).transpose ();
        });
        const double scale = covariance.cwiseAbs ().maxCoeff ();
        if (!(scale > 0.0))
        {
          result.is_line = true;
          result.curvature = 0.0;
          return result;
        }
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver (covariance / scale);
        const Eigen::Vector3d values = solver.eigenvalues ();
        result.normal = solver.eigenvectors ().col (0);
        result.curvature = std::max (values[0], 0.0) / values.sum ();
        result.is_line = values[1] <= 1e-10 * values[2];
        constexpr double F32_ROUNDING = 1.0 / (1 << 24);
        result.is_below_f32 = values[1] * scale <= 4.0 * F32_ROUNDING * squares; // four roundings: two sums, their
                                                                                 // product, the difference
        result.is_plane_defined = !result.is_line && values[1] >= 1.01 * values[0];
        return result;
      }

      Result
      average3DGradient () const
      {
        Eigen::Vector3d horizontal = Eigen::Vector3d::Zero (), vertical = Eigen::Vector3d::Zero ();
        int count_horizontal = 0, count_vertical = 0;
        const auto add = [] (const Eigen::Vector3d &difference, int weight, Eigen::Vector3d &sum, int &count)
        {
          if (!difference.allFinite ())
            return;
          sum += weight * difference;
          count += weight;
        };
        const int last_x = static_cast<int> (cloud_.width) - 1, last_y = static_cast<int> (cloud_.height) - 1;
        walk (x_ - side_ / 2, y_ - side_ / 2, side_, side_, [&] (int x, int y, int weight)
        {
          const bool is_frame = x == 0 || y == 0 || x == last_x || y == last_y;
          const Eigen::Vector3d zero = Eigen::Vector3d::Zero ();
          add (is_frame ? zero : at (x + 1, y) - at (x - 1, y), weight, horizontal, count_horizontal);
          add (is_frame ? zero : at (x, y + 1) - at (x, y - 1), weight, vertical, count_vertical);
        });
        if (count_horizontal == 0 || count_vertical == 0)
          return Result ();
        return fromTangents (vertical, horizontal);
      }

      /** \brief The mean z of a half window; NaN if there is none. */
      double
      meanZ (int start_x, int start_y) const
      {
        double sum = 0.0;
        std::uint32_t count = 0; // unsigned, as in PCL: also where a reversed interval takes more than there is
        walk (start_x, start_y, side_ / 2, side_ / 2, [&] (int x, int y, int weight)
        {
          const double z = at (x, y).z ();
          if (!std::isfinite (z))
            return;
          sum += weight * z;
          count += static_cast<std::uint32_t> (weight);
        });
        return count == 0 ? std::numeric_limits<double>::quiet_NaN () : sum / count;
      }

      Eigen::Vector3d
      single (int x, int y) const
      {
        return at (fold (x, cloud_.width, mirror_), fold (y, cloud_.height, mirror_));
      }

      Result
      averageDepthChange () const
      {
        const int half = side_ / 2, quarter = side_ / 4;
        const double left_z = meanZ (x_ - half, y_ - quarter), right_z = meanZ (x_ + 1, y_ - quarter);
        const double up_z = meanZ (x_ - quarter, y_ - half), down_z = meanZ (x_ - quarter, y_ + 1);
        Eigen::Vector3d horizontal = single (x_ + quarter + 1, y_) - single (x_ - quarter - 1, y_);
        Eigen::Vector3d vertical = single (x_ + 1, y_ + quarter) - single (x_ - 1, y_ - quarter);
        horizontal.z () = right_z - left_z;
        vertical.z () = down_z - up_z;
        return fromTangents (horizontal, vertical);
      }

      Result
      simple3DGradient () const
      {
        const int half = side_ / 2;
        const auto strip = [&] (int start_x, int start_y, int width, int height)
        {
          Eigen::Vector3d sum = Eigen::Vector3d::Zero ();
          walk (start_x, start_y, width, height, [&] (int x, int y, int weight)
          {
            const Eigen::Vector3d point = at (x, y);
            if (point.allFinite ())
              sum += weight * point;
          });
          return sum;
        };
        const int left = x_ - half, top = y_ - half;
        const Eigen::Vector3d horizontal = strip (x_ + half, top, 1, side_) - strip (left, top, 1, side_);
        const Eigen::Vector3d vertical = strip (left, y_ + half, side_, 1) - strip (left, top, side_, 1);
        return fromTangents (vertical, horizontal);
      }

      const Cloud &cloud_;
      bool mirror_;
      int x_, y_, side_;
  };
}
