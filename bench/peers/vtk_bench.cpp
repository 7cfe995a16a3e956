// VTK's FlyingEdges3D with normals, on one thread, from floats.

#include <cstdlib>

#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include "bench/peers/smooth_report.h"

namespace quoin::peers {
namespace {

struct Prepared {
  std::vector<vtkSmartPointer<vtkImageData>> images;
  vtkSmartPointer<vtkFlyingEdges3D> filter;
};

Prepared prepare(const std::vector<std::vector<float>>& fields) {
  // Its header is not valid C++20; VTK reads this variable on first use.
  setenv("VTK_SMP_BACKEND_IN_USE", "Sequential", 1);
  setenv("VTK_SMP_MAX_THREADS", "1", 1);
  Prepared prepared;
  for (const auto& field : fields) {
    vtkNew<vtkFloatArray> values;
    values->SetNumberOfValues(static_cast<vtkIdType>(field.size()));
    for (std::size_t i = 0; i < field.size(); ++i) values->SetValue(static_cast<vtkIdType>(i), field[i]);
    const auto image = vtkSmartPointer<vtkImageData>::New();
    image->SetDimensions(64, 64, 64);
    image->GetPointData()->SetScalars(values);
    prepared.images.push_back(image);
  }
  prepared.filter = vtkSmartPointer<vtkFlyingEdges3D>::New();
  prepared.filter->SetValue(0, 0.0);
  prepared.filter->ComputeNormalsOn();
  prepared.filter->ComputeGradientsOff();
  prepared.filter->ComputeScalarsOff();
  return prepared;
}

void mesh(Prepared& prepared, std::size_t i) {
  prepared.filter->SetInputData(prepared.images[i]);
  prepared.filter->Modified();
  prepared.filter->Update();
}

PeerMesh take(const Prepared& prepared) {
  vtkPolyData* const out = prepared.filter->GetOutput();
  PeerMesh mesh;
  mesh.triangles = out->GetNumberOfPolys();
  if (out->GetPointData()->GetNormals() == nullptr) return {};
  for (vtkIdType i = 0; i < out->GetNumberOfPoints(); ++i) {
    const double* const p = out->GetPoint(i);
    mesh.vertices.emplace_back(p[0], p[1], p[2]);
  }
  return mesh;
}

[[maybe_unused]] const bool kRegistered = [] {
  add_smooth("peer/vtk/", "normals", workloads::kTerrainTriangles, prepare, mesh, take);
  return true;
}();

}  // namespace
}  // namespace quoin::peers
