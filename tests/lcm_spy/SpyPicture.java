// Drives lcm-spy as a person would: waits until it has decoded what is on the bus, opens two messages by a double click, takes a
// picture of the screen. Exit status 1: a channel came that lcm-spy has no type for, or one that should have come did not.
//   java -cp LCM_JAR:JCHART2D_JAR SpyPicture.java URL PICTURE.png     (the types' jar on CLASSPATH, a display)

import java.awt.Component;
import java.awt.Container;
import java.awt.Frame;
import java.awt.Rectangle;
import java.awt.Robot;
import java.awt.event.MouseEvent;
import java.io.File;
import java.util.ArrayList;
import java.util.List;
import java.util.Map;
import java.util.TreeMap;
import javax.imageio.ImageIO;
import javax.swing.JTable;
import javax.swing.SwingUtilities;

public class SpyPicture {
  static final List<String> EXPECTED = List.of("CONSTRAINT", "CORRECTION_1", "HAVE", "KEYFRAME_1", "MAP_STATE",
      "PLACE_MATCH", "POSE_1", "POSE_2", "STATUS_agent_handler", "STATUS_posegraph");
  static final int WIDTH = 1560;
  static final int HEIGHT = 760;

  static <T extends Component> T find(Component in, Class<T> type) {
    if (type.isInstance(in)) {
      return type.cast(in);
    }
    if (in instanceof Container container) {
      for (Component child : container.getComponents()) {
        T found = find(child, type);
        if (found != null) {
          return found;
        }
      }
    }
    return null;
  }

  static Frame frameTitled(String text) throws Exception {
    for (int i = 0; i < 100; ++i) {
      for (Frame frame : Frame.getFrames()) {
        if (frame.isVisible() && frame.getTitle() != null && frame.getTitle().contains(text)) {
          return frame;
        }
      }
      Thread.sleep(100);
    }
    throw new Exception("lcm-spy opens no window of " + text);
  }

  static Map<String, String> typesByChannel(JTable table) throws Exception {
    Map<String, String> types = new TreeMap<>();
    SwingUtilities.invokeAndWait(() -> {
      try {
        for (int row = 0; row < table.getRowCount(); ++row) {
          types.put(table.getValueAt(row, 0).toString().trim(), String.valueOf(table.getValueAt(row, 1)).trim());
        }
      } catch (IndexOutOfBoundsException growing) {
        types.clear();  // lcm-spy adds rows in a thread that is not Swing's: looked at once more
      }
    });
    return types;
  }

  static void doubleClick(JTable table, String channel) throws Exception {
    SwingUtilities.invokeAndWait(() -> {
      for (int row = 0; row < table.getRowCount(); ++row) {
        if (table.getValueAt(row, 0).toString().trim().equals(channel)) {
          Rectangle cell = table.getCellRect(row, 0, true);
          table.dispatchEvent(new MouseEvent(table, MouseEvent.MOUSE_CLICKED, System.currentTimeMillis(), 0,
              cell.x + 3, cell.y + 3, 2, false, MouseEvent.BUTTON1));
          return;
        }
      }
    });
  }

  static void place(Frame frame, int x, int y, int width, int height) throws Exception {
    SwingUtilities.invokeAndWait(() -> {
      frame.setBounds(x, y, width, height);
      frame.validate();
    });
  }

  static List<String> wrong(Map<String, String> types) {
    List<String> wrong = new ArrayList<>();
    for (String channel : EXPECTED) {
      if (!types.containsKey(channel)) {
        wrong.add(channel + " did not come");
      }
    }
    types.forEach((channel, type) -> {
      if (!type.endsWith("_t") && !channel.equals("LCM_SELF_TEST")) {
        wrong.add(channel + " is not decoded: " + type);
      }
    });
    return wrong;
  }

  // The windows' threads would keep a failed program alive.
  public static void main(String[] arguments) {
    try {
      look(arguments);
    } catch (Exception error) {
      error.printStackTrace();
      System.exit(1);
    }
  }

  static void look(String[] arguments) throws Exception {
    new Thread(() -> {
      try {
        Class.forName("lcm.spy.Spy").getMethod("main", String[].class)
            .invoke(null, (Object) new String[] {"--lcm-url=" + arguments[0]});
      } catch (ReflectiveOperationException error) {
        error.printStackTrace();
        System.exit(1);
      }
    }).start();
    Frame overview = frameTitled("LCM Spy");
    JTable table = find(overview, JTable.class);
    Map<String, String> types = typesByChannel(table);
    for (int i = 0; i < 300 && !wrong(types).isEmpty(); ++i) {
      Thread.sleep(100);
      types = typesByChannel(table);
    }
    place(overview, 0, 0, 820, 370);
    doubleClick(table, "STATUS_posegraph");
    place(frameTitled("STATUS_posegraph"), 825, 0, WIDTH - 825, HEIGHT);
    doubleClick(table, "POSE_1");
    place(frameTitled("POSE_1"), 0, 375, 820, HEIGHT - 375);
    Thread.sleep(2500);  // one more of each, and the windows drawn

    ImageIO.write(new Robot().createScreenCapture(new Rectangle(WIDTH, HEIGHT)), "png", new File(arguments[1]));
    types = typesByChannel(table);
    types.forEach((channel, type) -> System.out.println(channel + " " + type));
    wrong(types).forEach(text -> System.err.println("lcm-spy: " + text));
    System.exit(wrong(types).isEmpty() ? 0 : 1);
  }
}
