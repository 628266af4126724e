// Hobble in Unity: only written, never compiled. Put Hobble.cs and this file into Assets, the compiled runtime into Assets/Plugins, and
// character.hob as character.bytes into Assets. `joints` are the transforms of the joints, in the order of the file.
using UnityEngine;

public class HobbleCharacter : MonoBehaviour
{
    public TextAsset character;
    public Transform[] joints;
    public Vector3 velocity = new Vector3(0, 0, 1.5f); // metres a second, in the world
    public LayerMask ground = ~0;
    [Range(0, 10)] public double leftThigh;

    Hobble hobble;
    double due;

    void Start() { hobble = new Hobble(character.bytes); }
    void OnDestroy() { hobble.Dispose(); }

    // Unity is left-handed and in metres: x changes its sign.
    double Height(double x, double z)
    {
        var above = new Vector3(-(float)x / 100, transform.position.y + 50, (float)z / 100);
        return Physics.Raycast(above, Vector3.down, out RaycastHit hit, 100, ground) ? 100 * hit.point.y : 0;
    }

    void Update()
    {
        hobble.targets[0].velocityX = -velocity.x * 100 / 60;
        hobble.targets[0].velocityZ = velocity.z * 100 / 60;
        hobble.Set(0, "injury", "left thigh", leftThigh);
        for (due += Mathf.Min(Time.deltaTime, .1f) * 60; due >= 1; due--) hobble.Frame(Height);
        hobble.ReadPose();
        double[] p = hobble.positions, r = hobble.rotations;
        for (int j = 0; j < joints.Length; j++)
        {
            joints[j].position = new Vector3(-(float)p[3 * j], (float)p[3 * j + 1], (float)p[3 * j + 2]) / 100;
            joints[j].rotation = new Quaternion((float)r[4 * j + 1], -(float)r[4 * j + 2], -(float)r[4 * j + 3], (float)r[4 * j]);
        }
    }
}
