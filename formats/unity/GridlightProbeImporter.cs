// SPDX-License-Identifier: MIT-0
// Writes probes that "gridlight export --to unity" exported into the light probes of the open scene.
//
// Put this file into a folder called Editor and the JSON anywhere in Assets. Then, in the menu Tools > Gridlight:
//   1. "Create Light Probe Group" places probes where Gridlight baked them.
//   2. Generate lighting once (Window > Rendering > Lighting), so that Unity connects the probes.
//   3. "Apply Light" replaces the light of every probe inside the volume; repeat it after every generation.
// Unity's probes may stand elsewhere too: the exported grid is interpolated at each of them.

using System.IO;
using UnityEditor;
using UnityEngine;
using UnityEngine.Rendering;

public static class GridlightProbeImporter
{
    [System.Serializable]
    private class Probes
    {
        public string format;
        public int version;
        public string volume;
        public int[] resolution;        // probes along the grid's axes
        public float[] worldToLattice;  // 3 x 4, row by row: position to grid coordinates, probes at whole numbers
        public float[] positions;       // x, y, z of each probe, first axis fastest
        public float[] coefficients;    // 9 red, 9 green, 9 blue of each probe
    }

    [MenuItem("Tools/Gridlight/Create Light Probe Group...")]
    private static void CreateGroup()
    {
        Probes probes = Load();
        if (probes == null) return;
        var positions = new Vector3[probes.positions.Length / 3];
        for (int i = 0; i < positions.Length; i++)
            positions[i] = new Vector3(probes.positions[3 * i], probes.positions[3 * i + 1], probes.positions[3 * i + 2]);
        var holder = new GameObject("Gridlight " + probes.volume);
        holder.AddComponent<LightProbeGroup>().probePositions = positions;
        Undo.RegisterCreatedObjectUndo(holder, "Create Light Probe Group");
        Selection.activeGameObject = holder;
    }

    [MenuItem("Tools/Gridlight/Apply Light...")]
    private static void ApplyLight()
    {
        LightProbes target = LightmapSettings.lightProbes;
        if (target == null || target.count == 0)
        {
            EditorUtility.DisplayDialog("Gridlight", "This scene has no baked light probes. Create the Light Probe Group and generate lighting first.", "OK");
            return;
        }
        Probes probes = Load();
        if (probes == null) return;
        SphericalHarmonicsL2[] light = target.bakedProbes;
        Vector3[] positions = target.positions;
        int changed = 0;
        for (int i = 0; i < positions.Length; i++)
            if (Sample(probes, positions[i], out SphericalHarmonicsL2 sampled))
            {
                light[i] = sampled;
                changed++;
            }
        Undo.RecordObject(target, "Apply Gridlight");
        target.bakedProbes = light;
        EditorUtility.SetDirty(target);
        SceneView.RepaintAll();
        Debug.Log("Gridlight: " + changed + " of " + positions.Length + " light probes replaced.");
    }

    private static Probes Load()
    {
        string path = EditorUtility.OpenFilePanel("Probes exported by Gridlight", Application.dataPath, "json");
        if (string.IsNullOrEmpty(path)) return null;
        var probes = JsonUtility.FromJson<Probes>(File.ReadAllText(path));
        if (probes == null || probes.format != "gridlight-unity" || probes.version != 1)
        {
            EditorUtility.DisplayDialog("Gridlight", path + " was not exported with --to unity, or by a newer Gridlight.", "OK");
            return null;
        }
        return probes;
    }

    // Trilinear interpolation of the grid; false for positions more than half a cell outside it.
    private static bool Sample(Probes probes, Vector3 position, out SphericalHarmonicsL2 result)
    {
        result = new SphericalHarmonicsL2();
        var cell = new int[3];
        var share = new float[3];
        for (int axis = 0; axis < 3; axis++)
        {
            float[] m = probes.worldToLattice;
            float place = m[4 * axis] * position.x + m[4 * axis + 1] * position.y + m[4 * axis + 2] * position.z + m[4 * axis + 3];
            int last = probes.resolution[axis] - 1;
            if (place < -0.5f || place > last + 0.5f) return false;
            place = Mathf.Clamp(place, 0, last);
            cell[axis] = Mathf.Clamp((int)place, 0, Mathf.Max(last - 1, 0));
            share[axis] = place - cell[axis];
        }
        for (int corner = 0; corner < 8; corner++)
        {
            float weight = 1;
            int node = 0, stride = 1;
            for (int axis = 0; axis < 3; axis++)
            {
                int step = (corner >> axis) & 1;
                weight *= step == 1 ? share[axis] : 1 - share[axis];
                node += stride * Mathf.Min(cell[axis] + step, probes.resolution[axis] - 1);
                stride *= probes.resolution[axis];
            }
            if (weight == 0) continue;
            for (int color = 0; color < 3; color++)
                for (int i = 0; i < 9; i++)
                    result[color, i] += weight * probes.coefficients[27 * node + 9 * color + i];
        }
        return true;
    }
}
